// Mean over blocks of voxels: one pyramid level from the one below, or from any below that.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// Blocks of `factor` voxels that cover `voxels` of them; the last one may hang over the edge.
constexpr int64_t reduced_length(int64_t voxels, int64_t factor) noexcept { return (voxels + factor - 1) / factor; }

// The shape of dst: ceil(n / factor) along each axis.
constexpr Shape3 reduced_shape(Shape3 shape, Shape3 factors) noexcept {
    return {reduced_length(shape.z, factors.z), reduced_length(shape.y, factors.y), reduced_length(shape.x, factors.x)};
}

// Voxels in one block above which box_reduce could lose exactness.
inline constexpr int64_t max_box_voxels = int64_t{1} << 31;

// dst[k] = mean of the factors.z × factors.y × factors.x voxels of block k. A block that hangs over the edge behaves as
// if the edge voxel were repeated. The mean is rounded once:
//   integers  summed exactly, rounded half to even;
//   float32   summed in double, each row from left to right, then the rows in order of z and y; divided by the number
//   of
//             voxels; rounded to float32. NaN propagates, and is written as 0x7fc00000 whatever its payload was.
// factors >= 1 with a product of at most max_box_voxels; dst holds reduced_shape(shape, factors).
// T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void box_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, int threads) noexcept;

}  // namespace volprep
