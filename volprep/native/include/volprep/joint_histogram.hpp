// How often each value of level 0 occurs where a coarser level, as a renderer sees it, has each value.
// After the conditional distributions of sparse pdf volumes (Sicat et al., 2014), for whole levels instead of voxels.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// Bins of either value: bin b holds the codes around b / 255 of the largest code.
inline constexpr int64_t joint_bins = 256;
inline constexpr int64_t joint_counts = joint_bins * joint_bins;
// Counts of a call have 32 bits.
inline constexpr int64_t max_joint_voxels = (int64_t{1} << 32) - 1;

// Slices of a volume of `depth` slices, `first` being the number of the first of them.
template <typename T>
struct Slices {
    const T* voxels;
    Shape3 shape;
    int64_t first;
    int64_t depth;
};

// counts[256·c + f] += number of voxels of src in bin f at whose centres the level is in bin c: trilinear between the
// centres of its voxels, clamped beyond the outer ones. Codes of 16 bits fall into the nearest bin, values between
// codes too, from the middle on into the upper one. `level` holds every slice of the level beside a slice of src; its
// factors are `factors`. Scratch of each thread: joint_counts of `lanes`, level.shape.x of `rows`. Integers throughout:
// the counts do not depend on threads. T: uint8_t, uint16_t.
template <typename T>
void joint_histogram(Slices<T> src, Slices<T> level, Shape3 factors, uint64_t* counts, uint32_t* lanes, int64_t* rows,
                     int threads) noexcept;

}  // namespace volprep
