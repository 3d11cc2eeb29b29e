// Values along rays, and the light that a transfer function makes of them.
#pragma once

#include <cstdint>
#include <span>

#include "volprep/shape.hpp"

namespace volprep {

// Pre-integration of a transfer function: the light of a ray segment along which the value changes linearly (Engel,
// Kraus and Ertl 2001), with all attenuation inside the segment.

// A transfer function: `count` control points, values ascending (two equal ones make a jump), colours [count, 3],
// extinctions per millimetre, not negative and finite. Linear between the points, constant outside.
struct ControlPoints {
    int64_t count;
    const double* values;
    const double* colours;
    const double* extinctions_per_mm;
};

// For each of n segments of length step_mm, whose value runs linearly from front[i] to back[i], entry i of
// light [n, 4] becomes its mean extinction per millimetre (last) and the colour of its light: light / opacity, where
// opacity = 1 − exp(−mean extinction · step). Without extinction (an opacity below 1e-200) it is the plain mean of the
// colour; where front and back are equal, the function at that value, and at a jump the mean of both sides. Relative
// error of colours below 1e-9. step_mm > 0; threads >= 1.
void preintegrate(const double* front, const double* back, int64_t n, const ControlPoints& points, double step_mm,
                  double* light, int threads);

// The light of rays that run along columns of voxels, through their centres, or along samples: emission and absorption,
// a sample at a time.

// Values [voxels][count] of columns of voxels, front to back.
struct Columns {
    const double* values;
    int64_t voxels;
    int64_t count;
    const double* spacings_mm;  // [count]
    bool nearest;  // each voxel is one sample; else the value is linear between voxels, with two samples between them
    const double* brightness;  // [voxels][count]: how bright each sample is, only if `nearest`; null if not lit
};

// light[column][4] = premultiplied colour and opacity, front to back, each sample of opacity
// 1 − exp(−extinction · length). At a jump of the function the upper side counts.
void column_light(const Columns& columns, const ControlPoints& points, double* light, int threads);

// The light of rays through a scan with its segments: at each sample the media of several styles are mixed.

// Rays [voxels][count] that are known in the middles of equal segments, and linear between these.
struct MixedRays {
    const double* values;
    int64_t voxels;
    int64_t count;
    const float* looks;        // [style][voxels][count][4]: factors of colour times extinction, and of extinction
    const double* brightness;  // [voxels][count]; null if not lit
};

// light[ray][4] = premultiplied colour and opacity of `samples` in the middles of equal segments of `length_mm`, front
// to back, each of opacity 1 - exp(-extinction * length); `styles` has the function of each style. At a jump of a
// function the upper side counts.
void mixed_light(const MixedRays& rays, std::span<const ControlPoints> styles, int64_t samples, double length_mm,
                 double* light, int threads);

// The light of rays along which the value is linear between samples at equal distances: what their pieces give, with
// all attenuation inside them (straight_segment.hpp).

// Values [samples][count] of rays: sample i lies in the middle of segment i; all segments are equally long.
struct SampledRays {
    const double* values;
    int64_t samples;
    int64_t count;
};

// light[ray][4] = premultiplied colour and opacity of `pieces` equal pieces of each ray, front to back, each piece_mm
// long: the value runs linearly between their ends, where it is linear between samples, and constant beyond the outer
// ones. pieces >= 1, piece_mm > 0.
void straight_light(const SampledRays& rays, const ControlPoints& points, int64_t pieces, double piece_mm,
                    double* light, int threads);

// The light of rays from samples along them and a lookup table, and how it changes with the table: what fitting a table
// to pictures needs.

// A lookup table, linear between its entries: value 0 is the first, 1 the last.
struct LightTable {
    int64_t entries;     // at least 2
    const double* rgba;  // [entries][4] linear colour, and extinction per millimetre
};

// Samples in the middles of equal segments of rays, as sample_rays writes them, times `scale` the values of the table.
struct RaySamples {
    int64_t count;
    const int64_t* offsets;   // [count + 1]
    const double* length_mm;  // [count]
    const float* samples;
    double scale;
};

// light[ray][4] = premultiplied colour and opacity: segments of opacity 1 - exp(-extinction · length), front to back.
void ray_light(const RaySamples& rays, const LightTable& table, double* light, int threads) noexcept;

// Gauss-Newton's equations for a change of the table that is linear between `knots` values at equal distances, from 0
// to 1: of red, green and blue by a change of the colour, and of the extinction as a change of its square root. With
// `light` as ray_light gives it for this table, r = light - target and J its derivative by the 4 · knots unknowns (all
// of red, of green, of blue, of the root): matrix [4 · knots][4 · knots] = JᵀJ / count, gradient [4 · knots] = Jᵀr /
// count. The sums do not depend on the number of threads.
void light_equations(const RaySamples& rays, const LightTable& table, const double* light, const double* target,
                     int64_t knots, double* matrix, double* gradient, int threads) noexcept;

// Solves matrix · x = rhs in place (rhs becomes x) for a symmetric positive definite matrix [n][n], by Cholesky's
// decomposition, which overwrites the lower triangle. Gives false where the matrix is not positive definite.
bool solve_positive(double* matrix, double* rhs, int64_t n) noexcept;

// Trilinear samples of a volume along rays, slab by slab: a pass over a volume of any depth leaves a bounded number of
// samples, which give pictures for any number of transfer functions.

// Rays through a volume: ray r has offsets[r + 1] - offsets[r] samples in the middles of equal segments.
struct Rays {
    int64_t count;
    const double* origin_xyz;     // [count][3] position at length 0, in voxels: 0 is the centre of voxel 0
    const double* direction_xyz;  // [count][3] voxels per millimetre
    const double* length_mm;      // [count]
    const int64_t* offsets;       // [count + 1], from 0, ascending
};

// Writes those samples between slices whose lower one is in src; src is slices first.. of a volume of `depth` slices,
// at least two of them where the volume has two. Slabs that share one slice write each sample once. Positions outside
// the centres of the outer voxels are moved to them. T: uint8_t, uint16_t.
template <typename T>
void sample_rays(const T* src, Shape3 shape, int64_t first, int64_t depth, const Rays& rays, float* samples,
                 int threads) noexcept;

// Samples along rays through small patches of a volume, which throw a ray back where it would leave them, as the
// cushions of a billiard table do a ball.

// Patches of one shape, one behind the other.
struct Patches {
    const double* values;
    int64_t count;
    Shape3 shape;
};

// Rays through patches: ray r runs through patch r % patches.count, and sample i lies at
// start[r] + (i + 0.5) · step_mm · velocity[r], in voxels from the corner of the patch.
struct PatchRays {
    const double* start_zyx;     // [count][3]
    const double* velocity_zyx;  // [count][3] voxels per millimetre
    int64_t count;
    int64_t samples;
    double step_mm;
};

// values[sample][ray] = the field there, trilinear between the centres of voxels and constant beyond the outer ones.
void sample_patches(const Patches& patches, const PatchRays& rays, double* values, int threads) noexcept;

}  // namespace volprep
