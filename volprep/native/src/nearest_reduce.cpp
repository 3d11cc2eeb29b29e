// Every factor-th voxel.
#include <algorithm>

#include "volprep/clones.hpp"
#include "volprep/reductions.hpp"

namespace volprep {
namespace {

template <typename T>
VOLPREP_CLONES void pick(const T* row, int64_t factor, int64_t count, T* __restrict dst) noexcept {
    for (int64_t k = 0; k < count; ++k) {
        dst[k] = row[k * factor];
    }
}

constexpr int64_t chosen(int64_t cell, int64_t factor, int64_t voxels) noexcept {
    return std::min(cell * factor + factor / 2, voxels - 1);
}

}  // namespace

template <typename T>
void nearest_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, int threads) noexcept {
    const Shape3 reduced = reduced_shape(shape, factors);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t index = 0; index < reduced.z * reduced.y; ++index) {
        const int64_t z = chosen(index / reduced.y, factors.z, shape.z);
        const int64_t y = chosen(index % reduced.y, factors.y, shape.y);
        const T* const row = src + (z * shape.y + y) * shape.x;
        T* const to = dst + index * reduced.x;
        pick(row + std::min(factors.x / 2, shape.x - 1), factors.x, reduced.x - 1, to);
        to[reduced.x - 1] = row[chosen(reduced.x - 1, factors.x, shape.x)];
    }
}

template void nearest_reduce(const uint8_t*, Shape3, Shape3, uint8_t*, int) noexcept;
template void nearest_reduce(const int16_t*, Shape3, Shape3, int16_t*, int) noexcept;
template void nearest_reduce(const uint16_t*, Shape3, Shape3, uint16_t*, int) noexcept;
template void nearest_reduce(const float*, Shape3, Shape3, float*, int) noexcept;

}  // namespace volprep
