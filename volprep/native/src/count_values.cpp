// The histogram of stored integers: see the header.
#include "volprep/count_values.hpp"

#include <omp.h>

#include <algorithm>

namespace volprep {

template <typename T>
void count_values(const T* src, int64_t voxels, uint64_t* histogram, uint32_t* lanes, int threads) noexcept {
    constexpr int64_t bins = stored_bins<T>;
#pragma omp parallel num_threads(threads)
    {
        uint32_t* const own = lanes + omp_get_thread_num() * tally_lanes * bins;
#pragma omp for schedule(static)
        for (int64_t begin = 0; begin < voxels; begin += tally_chunk) {
            tally(src + begin, std::min(tally_chunk, voxels - begin), bins, stored_bin<T>, own);
        }
#pragma omp for schedule(static)
        for (int64_t bin = 0; bin < bins; ++bin) {
            histogram[bin] += tallied(lanes, bins, bin, threads);
        }
    }
}

template void count_values(const uint8_t*, int64_t, uint64_t*, uint32_t*, int) noexcept;
template void count_values(const int16_t*, int64_t, uint64_t*, uint32_t*, int) noexcept;
template void count_values(const uint16_t*, int64_t, uint64_t*, uint32_t*, int) noexcept;

}  // namespace volprep
