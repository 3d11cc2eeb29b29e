// Counting how often each of a fixed set of small numbers occurs, in parallel.
#pragma once

#include <cstdint>
#include <limits>

namespace volprep {

// Each thread counts in `tally_lanes` tables of its own, one for each of four consecutive voxels: in a run of equal
// voxels the next increment would otherwise wait for the store of the last one (117 MB of uint8 zeros, two threads: 45
// → 31 ms).
inline constexpr int tally_lanes = 4;

// The most voxels of one call: no uint32 lane can overflow, and no sum of squared errors (see statistics.hpp).
inline constexpr int64_t max_tally_voxels = int64_t{1} << 34;

// The number of different stored values, and the bin of one of them: bins ascend with the value.
template <typename T>
inline constexpr int64_t stored_bins = int64_t{1} << (8 * sizeof(T));
template <typename T>
constexpr int64_t stored_bin(T stored) noexcept {
    return int64_t{stored} - std::numeric_limits<T>::lowest();
}

// Words of zeroed memory that the caller lends to a kernel that tallies.
constexpr int64_t tally_words(int64_t bins, int threads) noexcept { return bins * tally_lanes * threads; }

// Voxels that a kernel works through at a time: they stay in the L1 cache between its loops.
inline constexpr int64_t tally_chunk = 4096;

// Adds the bins of `voxels` values to one thread's lanes, which start at `lanes`.
template <typename Value, typename Bin>
void tally(const Value* values, int64_t voxels, int64_t bins, Bin bin, uint32_t* lanes) noexcept {
    int64_t x = 0;
    for (; x + tally_lanes <= voxels; x += tally_lanes) {
        ++lanes[bin(values[x])];
        ++lanes[bins + bin(values[x + 1])];
        ++lanes[2 * bins + bin(values[x + 2])];
        ++lanes[3 * bins + bin(values[x + 3])];
    }
    for (; x < voxels; ++x) {
        ++lanes[bin(values[x])];
    }
}

// Adds what all lanes of all threads counted in one bin.
inline uint64_t tallied(const uint32_t* lanes, int64_t bins, int64_t bin, int threads) noexcept {
    uint64_t count = 0;
    for (int lane = 0; lane < tally_lanes * threads; ++lane) {
        count += lanes[lane * bins + bin];
    }
    return count;
}

}  // namespace volprep
