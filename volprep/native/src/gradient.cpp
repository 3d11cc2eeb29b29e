// Gradients as float32 vectors.
#include "volprep/gradient_rows.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

using gradients::Sum;
using gradients::Sums;

template <typename S>
VOLPREP_CLONES void write_vectors(const Sums<S>& sums, GradientScale scale, int64_t count,
                                  float* __restrict dst) noexcept {
    for (int64_t x = 0; x < count; ++x) {
        const gradients::Vector vector = gradients::scaled(scale, sums.x[x], sums.y[x], sums.z[x]);
        dst[3 * x] = vector.x;
        dst[3 * x + 1] = vector.y;
        dst[3 * x + 2] = vector.z;
    }
}

}  // namespace

template <typename T>
void gradient(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, GradientScale scale, float* dst,
              int threads) noexcept {
    gradients::each_run(
        src, shape, halo, kernel, scale, resolve_threads(threads),
        [&](int64_t z, int64_t y, int64_t x, int64_t count, const Sums<Sum<T>>& sums, GradientScale own) {
            write_vectors(sums, own, count, dst + ((z * shape.y + y) * shape.x + x) * 3);
        });
}

template void gradient(const uint8_t*, Shape3, Halo, GradientKernel, GradientScale, float*, int) noexcept;
template void gradient(const uint16_t*, Shape3, Halo, GradientKernel, GradientScale, float*, int) noexcept;
template void gradient(const float*, Shape3, Halo, GradientKernel, GradientScale, float*, int) noexcept;

}  // namespace volprep
