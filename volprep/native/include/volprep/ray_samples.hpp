// Trilinear samples of a volume along rays, slab by slab: a pass over a volume of any depth leaves a bounded number of
// samples, which give pictures for any number of transfer functions.
#pragma once

#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep {

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

}  // namespace volprep
