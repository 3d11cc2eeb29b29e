// The histogram of a float32 volume over a given range.
#pragma once

#include "volprep/tally.hpp"

namespace volprep {

// histogram[b] += the number of voxels v with low <= v <= high and b = min(floor((v − low) · (bins / (high − low))),
// bins − 1), computed in double. Other voxels, NaN among them, are not counted. lanes has tally_words(bins + 1,
// threads) zeroed entries: bin number `bins` takes the values outside. low < high, both finite; 1 <= bins <= max_bins;
// threads >= 1; voxels <= max_tally_voxels.
inline constexpr int64_t max_bins = 1 << 16;
void bin_values(const float* src, int64_t voxels, double low, double high, int64_t bins, uint64_t* histogram,
                uint32_t* lanes, int threads) noexcept;

}  // namespace volprep
