// Weights of separable filters that make a level from level 0, and where a slab of level 0 lies.
#pragma once

#include <cstdint>

namespace volprep {

// Weights along one axis of the voxels that make one voxel of the level: `count` of them, symmetric about
// the centre of its cell, which is `factor` voxels wide. So a filter moves nothing, and a ramp stays a ramp.
struct Taps {
    const int32_t* weights;
    int64_t count;
    int64_t factor;

    // Voxels that the filter reaches beyond the cell on either side; negative where it does not fill the cell.
    constexpr int64_t reach() const noexcept { return (count - factor) / 2; }
    // The first voxel of cell k. May lie outside the volume: the edge is repeated there.
    constexpr int64_t first(int64_t cell) const noexcept { return cell * factor - reach(); }

    constexpr int64_t sum() const noexcept {
        int64_t total = 0;
        for (int64_t k = 0; k < count; ++k) {
            total += weights[k];
        }
        return total;
    }
    // The sum of the weights' sizes: how far a sum of voxels can grow.
    constexpr int64_t absolute() const noexcept {
        int64_t total = 0;
        for (int64_t k = 0; k < count; ++k) {
            total += weights[k] < 0 ? -weights[k] : weights[k];
        }
        return total;
    }
};

struct Taps3 {
    Taps z;
    Taps y;
    Taps x;
};

// The largest sum of absolute weights along an axis that keeps every sum of voxels exact.
inline constexpr int64_t max_absolute_weights = 2048;

// src holds slices src_z, src_z + 1, ... of a volume of `depth` slices; dst holds slices dst_z, ... of the level. src
// must hold every slice of the volume that the slices of dst are made from.
struct SlabPlace {
    int64_t src_z;
    int64_t depth;
    int64_t dst_z;
};

}  // namespace volprep
