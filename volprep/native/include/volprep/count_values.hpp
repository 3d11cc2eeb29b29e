// The exact histogram of stored integers. Their range, their used bits and every statistic follow from it.
#pragma once

#include "volprep/tally.hpp"

namespace volprep {

// histogram[stored − lowest value of T] += how often it occurs. histogram has stored_bins<T> entries (256 or 65536);
// lanes has tally_words(stored_bins<T>, threads) zeroed ones; threads >= 1; voxels <= max_tally_voxels. T: uint8_t,
// int16_t, uint16_t.
template <typename T>
void count_values(const T* src, int64_t voxels, uint64_t* histogram, uint32_t* lanes, int threads) noexcept;

}  // namespace volprep
