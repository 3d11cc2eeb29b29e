// The light of rays through voxels in memory, and its adjoint: how the light changes with the voxels. The planner
// measures and refines levels with it. Samples may be lit by the viewer: their shade is the cosine of ray and gradient,
// from central differences as shaders take them, so that a voxel moves the light of the samples around it, too.
#pragma once

#include <cstdint>

#include "volprep/rays.hpp"
#include "volprep/shape.hpp"

namespace volprep {

// A lookup table and the slopes that a step follows, both linear between entries: value 0 is the first, 1 the last.
struct SlopedTable {
    int64_t entries;       // at least 2
    const double* rgba;    // [entries][4] linear colour, and extinction per millimetre
    const double* slopes;  // [entries][4] their change with the value; smoothed slopes reach beyond a steep foot
};

// How samples are lit.
struct Headlight {
    double spacing_mm_xyz[3];  // of the voxels
    double apart_xyz[3];       // voxels to each side that differences are taken of
    double soft_per_mm;        // slope of the value at which a place is half a surface, above 0
};

// The light that some rays should have through one table.
struct RayTarget {
    SlopedTable table;
    const double* light;   // [rays.count][4]
    const double* weight;  // [rays.count] weight of a ray's squared error
};

// Numbers for each voxel: half the gradient of the sum of weighted squared errors of light, and a curvature. A step of
// gradient / curvature never raises the sum of a linear light: the curvature of a voxel is the sum of |slope of a ray's
// light by it| times the sum of |slopes of this ray's light by all voxels| (a separable surrogate, as tomography uses).
// A lit sample counts in the curvature once by its value and once by each of the six values beside it.
inline constexpr int64_t trace_numbers = 2;

// Writes the light [rays.count][4] of rays: premultiplied colour and opacity. `depths_mm` [rays.count], unless null, is
// where each shows most; half of its length if it shows nothing. src: [shape]; a code times `scale` is the value that
// the table takes, 0 to 1; slopes are not read. Unlit if `headlight` is null. T: uint8_t, uint16_t. Throws
// std::bad_alloc.
template <typename T>
void trace_light(const T* src, Shape3 shape, double scale, const Rays& rays, const Headlight* headlight,
                 const SlopedTable& table, double* light, double* depths_mm, int threads);

// Numbers in the room that trace_sums needs for a level.
int64_t trace_room(Shape3 shape) noexcept;

// Adds gradient and curvature [shape][trace_numbers] of a target to `sums`, and returns the sum of weighted squared
// errors. level: [shape], values 0 to 1. Rays beside each other in space are faster in this order. The sums do not
// depend on the number of threads. room: [trace_room(shape)], zeros at first; the next call for a level of this shape
// takes it as it was left, which saves a quarter of the time. Throws std::bad_alloc.
double trace_sums(const float* level, Shape3 shape, const Rays& rays, const Headlight* headlight,
                  const RayTarget& target, float* room, float* sums, int threads);

}  // namespace volprep
