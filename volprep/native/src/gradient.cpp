// Gradients as float32 vectors, and the longest of them.
#include <atomic>
#include <bit>
#include <cmath>

#include "volprep/gradient_rows.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

using gradients::each_run;
using gradients::Sum;
using gradients::Sums;
using gradients::transformed;
using gradients::Vector;

template <typename S, bool ROTATES>
VOLPREP_CLONES void write_vectors(const Sums<S>& sums, const GradientMatrix& matrix, int64_t count,
                                  float* __restrict dst) noexcept {
    for (int64_t x = 0; x < count; ++x) {
        const Vector vector = transformed<ROTATES>(matrix, sums.x[x], sums.y[x], sums.z[x]);
        dst[3 * x] = vector.x;
        dst[3 * x + 1] = vector.y;
        dst[3 * x + 2] = vector.z;
    }
}

// Bits of float32 numbers that are not negative ascend with them, and a maximum of integers becomes vectors (3.9 → 1.2
// ns a voxel).
template <typename S, bool ROTATES>
VOLPREP_CLONES float longest_squared(const Sums<S>& sums, const GradientMatrix& matrix, int64_t count) noexcept {
    int32_t longest = 0;
    for (int64_t x = 0; x < count; ++x) {
        const Vector v = transformed<ROTATES>(matrix, sums.x[x], sums.y[x], sums.z[x]);
        const auto squared = std::bit_cast<int32_t>(v.x * v.x + v.y * v.y + v.z * v.z);
        longest = squared > longest ? squared : longest;
    }
    return std::bit_cast<float>(longest);
}

}  // namespace

template <typename T>
void gradient(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, const GradientMatrix& matrix, float* dst,
              int threads) noexcept {
    const auto write = matrix.rotates ? write_vectors<Sum<T>, true> : write_vectors<Sum<T>, false>;
    each_run(src, shape, halo, kernel, matrix, resolve_threads(threads),
             [&](int64_t z, int64_t y, int64_t x, int64_t count, const Sums<Sum<T>>& sums, const GradientMatrix& own) {
                 write(sums, own, count, dst + ((z * shape.y + y) * shape.x + x) * 3);
             });
}

template <typename T>
float largest_gradient(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, const GradientMatrix& matrix,
                       int threads) noexcept {
    const auto longest = matrix.rotates ? longest_squared<Sum<T>, true> : longest_squared<Sum<T>, false>;
    std::atomic<float> result = 0.0F;
    each_run(src, shape, halo, kernel, matrix, resolve_threads(threads),
             [&](int64_t, int64_t, int64_t, int64_t count, const Sums<Sum<T>>& sums, const GradientMatrix& own) {
                 const float found = longest(sums, own, count);
                 float known = result.load(std::memory_order_relaxed);
                 while (found > known && !result.compare_exchange_weak(known, found, std::memory_order_relaxed)) {
                 }
             });
    return std::sqrt(result.load());
}

template void gradient(const uint8_t*, Shape3, Halo, GradientKernel, const GradientMatrix&, float*, int) noexcept;
template void gradient(const uint16_t*, Shape3, Halo, GradientKernel, const GradientMatrix&, float*, int) noexcept;
template void gradient(const float*, Shape3, Halo, GradientKernel, const GradientMatrix&, float*, int) noexcept;
template float largest_gradient(const uint8_t*, Shape3, Halo, GradientKernel, const GradientMatrix&, int) noexcept;
template float largest_gradient(const uint16_t*, Shape3, Halo, GradientKernel, const GradientMatrix&, int) noexcept;

}  // namespace volprep
