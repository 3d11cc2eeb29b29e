// The histogram of float32 voxels: see the header.
#include "volprep/bin_values.hpp"

#include <omp.h>

#include <algorithm>

#include "volprep/clones.hpp"

namespace volprep {
namespace {

// All in double and without a branch, so that it vectorises; a NaN passes the first choice and is caught by the second.
VOLPREP_CLONES void find_bins(const float* src, int64_t voxels, double low, double high, int32_t bins,
                              int32_t* __restrict found) noexcept {
    const double bins_per_unit = bins / (high - low);
    const double last = bins - 1;
    const double outside = bins;
    for (int64_t x = 0; x < voxels; ++x) {
        const double value = src[x];
        const double position = (value - low) * bins_per_unit;
        const double bin = position < last ? position : last;
        found[x] = static_cast<int32_t>(value >= low && value <= high ? bin : outside);
    }
}

}  // namespace

void bin_values(const float* src, int64_t voxels, double low, double high, int64_t bins, uint64_t* histogram,
                uint32_t* lanes, int threads) noexcept {
#pragma omp parallel num_threads(threads)
    {
        uint32_t* const own = lanes + omp_get_thread_num() * tally_lanes * (bins + 1);
        int32_t found[tally_chunk];
#pragma omp for schedule(static)
        for (int64_t begin = 0; begin < voxels; begin += tally_chunk) {
            const int64_t count = std::min(tally_chunk, voxels - begin);
            find_bins(src + begin, count, low, high, static_cast<int32_t>(bins), found);
            tally(found, count, bins + 1, [](int32_t bin) { return bin; }, own);
        }
#pragma omp for schedule(static)
        for (int64_t bin = 0; bin < bins; ++bin) {
            histogram[bin] += tallied(lanes, bins + 1, bin, threads);
        }
    }
}

}  // namespace volprep
