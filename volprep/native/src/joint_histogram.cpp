// Joint histogram of a volume and a coarser level: rows of the level are blended once for each row of voxels.
#include <omp.h>

#include <algorithm>
#include <limits>

#include "volprep/statistics.hpp"

namespace volprep {
namespace {

// The two voxels of a level beside the centre of a voxel of level 0, with weights in units of 1 / (2 · factor).
struct Beside {
    int64_t lower;
    int64_t upper;
    int64_t lower_weight;
    int64_t upper_weight;
};

Beside beside(int64_t voxel, int64_t factor, int64_t length) noexcept {
    const int64_t at = std::max<int64_t>(2 * voxel + 1 - factor, 0);
    const int64_t lower = std::min(at / (2 * factor), length - 1);
    const int64_t upper_weight = at - at / (2 * factor) * 2 * factor;
    return {lower, std::min(lower + 1, length - 1), 2 * factor - upper_weight, upper_weight};
}

template <typename T>
constexpr int64_t bin_of_code(T code) noexcept {
    constexpr int64_t step = std::numeric_limits<T>::max() / (joint_bins - 1);
    return (code + step / 2) / step;
}

}  // namespace

template <typename T>
void joint_histogram(Slices<T> src, Slices<T> level, Shape3 factors, uint64_t* counts, uint32_t* lanes, int64_t* rows,
                     int threads) noexcept {
    const int64_t width = level.shape.x;
    const double bins_per_sum =
        static_cast<double>(joint_bins - 1) / std::numeric_limits<T>::max() / static_cast<double>(8 * factors.voxels());
#pragma omp parallel num_threads(threads)
    {
        uint32_t* const own = lanes + omp_get_thread_num() * joint_counts;
        int64_t* const row = rows + omp_get_thread_num() * width;
#pragma omp for schedule(static)
        for (int64_t index = 0; index < src.shape.z * src.shape.y; ++index) {
            const Beside z = beside(src.first + index / src.shape.y, factors.z, level.depth);
            const Beside y = beside(index % src.shape.y, factors.y, level.shape.y);
            const auto at = [&](int64_t slice, int64_t line) {
                return level.voxels + ((slice - level.first) * level.shape.y + line) * width;
            };
            const T* const corners[] = {at(z.lower, y.lower), at(z.lower, y.upper), at(z.upper, y.lower),
                                        at(z.upper, y.upper)};
            for (int64_t x = 0; x < width; ++x) {
                row[x] = z.lower_weight * (y.lower_weight * corners[0][x] + y.upper_weight * corners[1][x]) +
                         z.upper_weight * (y.lower_weight * corners[2][x] + y.upper_weight * corners[3][x]);
            }
            const T* const voxels = src.voxels + index * src.shape.x;
            for (int64_t x = 0; x < src.shape.x; ++x) {
                const Beside along = beside(x, factors.x, width);
                const int64_t sum = along.lower_weight * row[along.lower] + along.upper_weight * row[along.upper];
                const auto bin = static_cast<int64_t>(static_cast<double>(sum) * bins_per_sum + 0.5);
                ++own[bin * joint_bins + bin_of_code(voxels[x])];
            }
        }
#pragma omp for schedule(static)
        for (int64_t entry = 0; entry < joint_counts; ++entry) {
            for (int thread = 0; thread < threads; ++thread) {
                counts[entry] += lanes[thread * joint_counts + entry];
            }
        }
    }
}

template void joint_histogram(Slices<uint8_t>, Slices<uint8_t>, Shape3, uint64_t*, uint32_t*, int64_t*, int) noexcept;
template void joint_histogram(Slices<uint16_t>, Slices<uint16_t>, Shape3, uint64_t*, uint32_t*, int64_t*, int) noexcept;

}  // namespace volprep
