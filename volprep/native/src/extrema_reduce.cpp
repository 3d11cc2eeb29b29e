// Minimum and maximum of blocks. The rows of a layer of blocks are folded into one, whole vectors whatever the factors,
// and only that one is then cut into blocks.
#include <omp.h>

#include <algorithm>

#include "volprep/clones.hpp"
#include "volprep/ordered.hpp"
#include "volprep/reductions.hpp"

namespace volprep {
namespace {

struct Least {
    template <typename Key>
    static constexpr bool is_before(Key a, Key b) noexcept {
        return a < b;
    }
};

struct Greatest {
    template <typename Key>
    static constexpr bool is_before(Key a, Key b) noexcept {
        return b < a;
    }
};

template <typename Order, typename T>
VOLPREP_CLONES void fold(const T* row, int64_t count, T* __restrict best) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        best[k] = Order::is_before(Sorted<T>::key(row[k]), Sorted<T>::key(best[k])) ? row[k] : best[k];
    }
}

// The best of each `factor` voxels of a row. A factor that the compiler knows (FACTOR > 0) becomes vectors.
template <typename Order, int64_t FACTOR, typename T>
VOLPREP_CLONES void cut(const T* row, int64_t factor, int64_t blocks, T* __restrict dst) noexcept {
    const int64_t length = FACTOR > 0 ? FACTOR : factor;
    for (int64_t block = 0; block < blocks; ++block) {
        T best = row[block * length];
        for (int64_t k = 1; k < length; ++k) {
            const T next = row[block * length + k];
            best = Order::is_before(Sorted<T>::key(next), Sorted<T>::key(best)) ? next : best;
        }
        dst[block] = best;
    }
}

template <typename Order, typename T>
void reduce_row(const T* src, Shape3 shape, Shape3 factors, int64_t z, int64_t y, T* scratch, T* dst) noexcept {
    const int64_t end_z = std::min(z + factors.z, shape.z);
    const int64_t end_y = std::min(y + factors.y, shape.y);
    for (int64_t begin = 0; begin < shape.x; begin += extrema_run(factors)) {
        const int64_t count = std::min(extrema_run(factors), shape.x - begin);
        std::copy_n(src + (z * shape.y + y) * shape.x + begin, count, scratch);
        for (int64_t k = z; k < end_z; ++k) {
            for (int64_t j = k == z ? y + 1 : y; j < end_y; ++j) {
                fold<Order>(src + (k * shape.y + j) * shape.x + begin, count, scratch);
            }
        }
        const int64_t whole = count / factors.x;
        T* const at = dst + begin / factors.x;
        (factors.x == 2 ? cut<Order, 2, T> : cut<Order, 0, T>)(scratch, factors.x, whole, at);
        if (whole * factors.x < count) {
            cut<Order, 0>(scratch + whole * factors.x, count - whole * factors.x, 1, at + whole);
        }
    }
}

}  // namespace

template <typename T>
void extrema_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst_min, T* dst_max, T* scratch,
                    int threads) noexcept {
    const Shape3 reduced = reduced_shape(shape, factors);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t index = 0; index < reduced.z * reduced.y; ++index) {
        const int64_t z = index / reduced.y * factors.z;
        const int64_t y = index % reduced.y * factors.y;
        T* const own = scratch + omp_get_thread_num() * extrema_run(factors);
        if (dst_min != nullptr) {
            reduce_row<Least>(src, shape, factors, z, y, own, dst_min + index * reduced.x);
        }
        if (dst_max != nullptr) {
            reduce_row<Greatest>(src, shape, factors, z, y, own, dst_max + index * reduced.x);
        }
    }
}

template void extrema_reduce(const uint8_t*, Shape3, Shape3, uint8_t*, uint8_t*, uint8_t*, int) noexcept;
template void extrema_reduce(const int16_t*, Shape3, Shape3, int16_t*, int16_t*, int16_t*, int) noexcept;
template void extrema_reduce(const uint16_t*, Shape3, Shape3, uint16_t*, uint16_t*, uint16_t*, int) noexcept;
template void extrema_reduce(const float*, Shape3, Shape3, float*, float*, float*, int) noexcept;

}  // namespace volprep
