// The adjoint of a ray's light: how the light of rays through a level changes with its voxels. Refining a level through
// the renderer takes one call for each step.
#pragma once

#include <cstdint>

#include "volprep/ray_samples.hpp"
#include "volprep/shape.hpp"

namespace volprep {

// A lookup table and the slopes that a step follows, both linear between entries: value 0 is the first, 1 the last.
struct SlopedTable {
    int64_t entries;       // at least 2
    const double* rgba;    // [entries][4] linear colour, and extinction per millimetre
    const double* slopes;  // [entries][4] their change with the value; smoothed slopes reach beyond a steep foot
};

// The light that some rays should have through one table.
struct RefineTarget {
    SlopedTable table;
    const double* light;   // [rays.count][4]
    const double* weight;  // [rays.count] weight of a ray's squared error
};

// Numbers for each voxel: half the gradient of the sum of weighted squared errors of light, and a curvature. A step of
// gradient / curvature never raises the sum of a linear light: the curvature of a voxel is the sum of |slope of a ray's
// light by it| times the sum of |slopes of this ray's light by all voxels| (a separable surrogate, as tomography uses).
inline constexpr int64_t refine_numbers = 2;

// Adds gradient and curvature [shape][refine_numbers] of a target to `sums`, and returns the sum of weighted squared
// errors. level: [shape], values 0 to 1. The sums do not depend on the number of threads. Throws std::bad_alloc.
double refine_sums(const float* level, Shape3 shape, const Rays& rays, const RefineTarget& target, float* sums,
                   int threads);

}  // namespace volprep
