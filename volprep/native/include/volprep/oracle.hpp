// The oracle: ray integrals of a trilinear field, or one of labels, and a piecewise linear transfer function, in
// float64, with a bound.
//
// For each pixel, light I = integral of c tau exp(-integral of tau) along its ray, and opacity 1 - exp(-integral of
// tau). The ray is cut at every plane of voxel centres and wherever the field crosses a control point; on a piece the
// field is a cubic, the optical depth an exact quartic, and the remaining integral is computed by a Gauss rule with a
// proven bound (src/oracle_beam.cpp). Splitting rays this way was described by Weiss and Westermann, "Differentiable
// Direct Volume Rendering and Ray Splitting", EuroVis 2021; the quadrature and its bound are our own derivation.
//
// The bound covers: quadrature; light behind the place where the ray was stopped; and rounding, to first order, with a
// ray that starts at the float64 origin and direction of its pixel. It is larger than the tolerance only where float64
// is too coarse for the question: a tolerance below about 1e-10, a ray inside a plateau that lies exactly on a jump of
// the transfer function, one within a face between two labels, or extinctions above 1e6 per mm.
//
// Of a field that is constant in each voxel, the ray is cut at the faces of voxels, and each piece is exact. Where it
// is lit, c is multiplied by the absolute cosine of ray and normal (src/oracle_lit.cpp).
#pragma once

#include <cstdint>

#include "volprep/gradient.hpp"
#include "volprep/oracle/planes.hpp"
#include "volprep/shape.hpp"

namespace volprep {

struct OracleTransfer {
    int64_t count;
    const double* values;              // [count], physical, ascending; equal neighbours make a jump
    const double* colours;             // [count, 3], linear RGB, not negative
    const double* extinctions_per_mm;  // [count], not negative; above 1e9 (and infinite) counts as 1e9
};

// Normals of lit voxels: `vectors`, or directions of gradients if it is null, for labels of the extinction; or, if
// `slope_scale` is not 0, slopes as a shader takes them by forward or central differences of stored values, times
// `slope_scale`. Along axes that are `halved`, central differences use values half a voxel to each side, as on a coarse
// level.
struct OracleNormals {
    GradientKernel kernel;
    const float* vectors;  // [z, y, x, (x, y, z)], as long as they are
    double slope_scale = 0.0;
    bool halved[3] = {false, false, false};  // x, y, z
};

struct OracleVolume {
    Shape3 shape;
    double slope;  // physical = slope * stored + intercept
    double intercept;
    double spacing_mm_xyz[3];
    double extent_mm_xyz[3];       // the box; may be smaller than spacing * voxels
    bool nearest;                  // the field is constant in each voxel, as labels are, not trilinear
    const OracleNormals* normals;  // none where nothing is lit
    oracle::Planes cut{};          // the volume ends at these
};

struct OracleView {
    int64_t height;
    int64_t width;
    const double* box_from_clip;  // [4, 4], clip coordinates to box space, columns are vectors
};

struct OraclePicture {
    OracleView view;
    double* rgba;   // [height, width, 4], premultiplied linear
    double* bound;  // [height, width], of each of the four channels
};

// Voxels must be finite. threads = 0: as many as OpenMP gives. The result does not depend on it.
// Voxel: uint8_t, int16_t, uint16_t, float.
template <typename Voxel>
void render_oracle(const Voxel* voxels, const OracleVolume& volume, const OracleTransfer& transfer, double tolerance,
                   const OraclePicture& picture, int threads) noexcept;

}  // namespace volprep
