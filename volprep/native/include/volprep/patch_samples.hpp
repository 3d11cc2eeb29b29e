// Samples along rays through small patches of a volume, which throw a ray back where it would leave them, as the
// cushions of a billiard table do a ball.
#pragma once

#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep {

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
