// A pyramid level by any separable linear filter: binomial, Gaussian, Lanczos and so on are weights.
#pragma once

#include <cstddef>

#include "volprep/shape.hpp"
#include "volprep/taps.hpp"

namespace volprep {

// dst[k] = Σ weights · voxels / 2^n, where 2^n is the product of the sums of the weights along z, y and x. Voxels
// outside the volume are those at its edge. Rounded once:
//   integers  summed exactly, rounded half to even, clamped to what T can hold;
//   float32   in double, along z, then y, then x, each pair by pair from the outermost voxels inwards:
//             ((w0 · (v0 + v_last)) + w1 · (v1 + v_last-1)) + ...; divided; rounded to float32. NaN propagates, and is
//             written as 0x7fc00000.
// With `clamp` the result is limited to the range of the voxels that have a weight: what a filter with negative weights
// would add beyond them belongs to other materials.
// src is a slab of the volume, `place` says which. scratch: linear_reduce_scratch bytes. threads >= 1.
// T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void linear_reduce(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, bool clamp, T* dst,
                   int64_t slices, std::byte* scratch, int threads) noexcept;

template <typename T>
int64_t linear_reduce_scratch(Shape3 shape, const Taps3& taps, bool clamp, int threads) noexcept;

}  // namespace volprep
