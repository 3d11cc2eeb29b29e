// Light of rays that is lit by the viewer, and its adjoint: how it changes with the voxels of a level. The shade of a
// sample is the cosine of ray and gradient, from central differences as shaders take them, so that a voxel moves the
// light of the samples around it, too.
#pragma once

#include <cstdint>

#include "volprep/ray_samples.hpp"
#include "volprep/refine_level.hpp"
#include "volprep/shape.hpp"

namespace volprep {

// How the samples of a level are lit.
struct Headlight {
    const double* spacing_mm_xyz;  // [3] of the level's voxels
    const double* apart_xyz;       // [3] voxels to each side that differences are taken of
    double soft_per_mm;            // Slope of the value of a place that counts half as a surface, above 0
};

// Writes the light [rays.count][4] of rays: premultiplied colour and opacity. src: [shape]; a code times `scale` is the
// value that the table takes, 0 to 1; slopes are not read. T: uint8_t, uint16_t. Throws std::bad_alloc.
template <typename T>
void lit_light(const T* src, Shape3 shape, double scale, const Rays& rays, const Headlight& headlight,
               const SlopedTable& table, double* light, int threads);

// As refine_sums, of lit light. A sample counts in the curvature once by its value and once by each of the six values
// beside it.
double lit_sums(const float* level, Shape3 shape, const Rays& rays, const Headlight& headlight,
                const RefineTarget& target, float* sums, int threads);

}  // namespace volprep
