// Normals in one pass: gradient and code of a run of voxels before the next is touched.
#include "volprep/normals.hpp"

#include "volprep/normal_codes.hpp"
#include "volprep/threads.hpp"

namespace volprep {

template <typename T>
void normals(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, GradientScale scale, NormalCode code,
             uint8_t* dst, int threads) noexcept {
    using S = gradients::Sum<T>;
    const int64_t bytes = normal_bytes(code);
    const gradients::Encoder<S> encode = gradients::encoder<S>(code);
    gradients::each_run(
        src, shape, halo, kernel, scale, resolve_threads(threads),
        [&](int64_t z, int64_t y, int64_t x, int64_t count, const gradients::Sums<S>& sums, GradientScale own) {
            encode(sums, own, count, dst + ((z * shape.y + y) * shape.x + x) * bytes);
        });
}

template void normals(const uint8_t*, Shape3, Halo, GradientKernel, GradientScale, NormalCode, uint8_t*, int) noexcept;
template void normals(const uint16_t*, Shape3, Halo, GradientKernel, GradientScale, NormalCode, uint8_t*, int) noexcept;
template void normals(const float*, Shape3, Halo, GradientKernel, GradientScale, NormalCode, uint8_t*, int) noexcept;

}  // namespace volprep
