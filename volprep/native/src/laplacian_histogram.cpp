// Histogram of the Laplacian's size: a row of it at a time, then a tally of the row.
#include <omp.h>

#include <type_traits>

#include "volprep/clones.hpp"
#include "volprep/statistics.hpp"

namespace volprep {
namespace {

// The two neighbours along one axis; the voxel itself, twice, where the axis is left out.
template <typename T>
struct Neighbours {
    const T* before;
    const T* after;
};

// Holds the Laplacian of a type: of bytes 16 of them fit a vector.
template <typename T>
using Laplacian = std::conditional_t<sizeof(T) == 1, int16_t, int32_t>;

// bins[x] = that of |L|, or `flat` where all neighbours equal the voxel.
template <typename T>
VOLPREP_CLONES void laplacian_row(const T* row, Neighbours<T> z, Neighbours<T> y, Neighbours<T> x, int64_t length,
                                  Laplacian<T> flat, Laplacian<T>* __restrict bins) noexcept {
    using Wide = Laplacian<T>;
    for (int64_t k = 0; k < length; ++k) {
        const T centre = row[k];
        const int32_t sum = z.before[k] + z.after[k] + y.before[k] + y.after[k] + x.before[k] + x.after[k];
        const auto laplacian = static_cast<Wide>(sum - 6 * centre);
        const auto difference = static_cast<T>((z.before[k] ^ centre) | (z.after[k] ^ centre) | (y.before[k] ^ centre) |
                                               (y.after[k] ^ centre) | (x.before[k] ^ centre) | (x.after[k] ^ centre));
        auto bin = static_cast<Wide>(laplacian < 0 ? -laplacian : laplacian);
        if constexpr (laplacian_bins<T> > laplacian_steps) {
            bin = laplacian_bin(bin);
        }
        bins[k] = difference == 0 ? flat : bin;
    }
}

// Voxels with two neighbours along an axis: [margin, length - margin).
constexpr int64_t margin(int64_t length) noexcept { return length >= 3 ? 1 : 0; }

}  // namespace

template <typename T>
void laplacian_histogram(const T* src, Shape3 shape, uint64_t* histogram, uint32_t* lanes, int32_t* rows,
                         int threads) noexcept {
    constexpr int64_t bins = laplacian_bins<T> + 1;
    const int64_t margin_z = margin(shape.z);
    const int64_t margin_y = margin(shape.y);
    const int64_t margin_x = margin(shape.x);
    const int64_t inner_y = shape.y - 2 * margin_y;
    const int64_t inner_z = shape.z - 2 * margin_z;
    const int64_t inner_x = shape.x - 2 * margin_x;
    const auto neighbours = [](const T* voxel, int64_t step) { return Neighbours<T>{voxel - step, voxel + step}; };
#pragma omp parallel num_threads(threads)
    {
        uint32_t* const own_lanes = lanes + omp_get_thread_num() * tally_lanes * bins;
        auto* const row = static_cast<Laplacian<T>*>(static_cast<void*>(rows + omp_get_thread_num() * shape.x));
#pragma omp for schedule(static)
        for (int64_t index = 0; index < inner_z * inner_y; ++index) {
            const int64_t z = margin_z + index / inner_y;
            const int64_t y = margin_y + index % inner_y;
            const T* const voxel = src + (z * shape.y + y) * shape.x + margin_x;
            laplacian_row(voxel, neighbours(voxel, margin_z * shape.slice()), neighbours(voxel, margin_y * shape.x),
                          neighbours(voxel, margin_x), inner_x, static_cast<Laplacian<T>>(bins - 1), row);
            tally(row, inner_x, bins, [](Laplacian<T> bin) { return bin; }, own_lanes);
        }
#pragma omp for schedule(static)
        for (int64_t bin = 0; bin < bins - 1; ++bin) {
            histogram[bin] += tallied(lanes, bins, bin, threads);
        }
    }
}

template void laplacian_histogram(const uint8_t*, Shape3, uint64_t*, uint32_t*, int32_t*, int) noexcept;
template void laplacian_histogram(const int16_t*, Shape3, uint64_t*, uint32_t*, int32_t*, int) noexcept;
template void laplacian_histogram(const uint16_t*, Shape3, uint64_t*, uint32_t*, int32_t*, int) noexcept;

}  // namespace volprep
