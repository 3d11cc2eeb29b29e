// Normals of a volume: directions of gradients, in codes of a few bytes.
#pragma once

#include "volprep/gradient.hpp"

namespace volprep {

// How a direction becomes bytes. Numbers are rounded half to even.
//   biased8  three bytes, round(127·n) + 128: 128 is an exact zero, and no gradient is 128 128 128
//   snorm8   three signed bytes, round(127·n): no gradient is 0 0 0
//   oct8     the octahedron unfolded into a square (Meyer et al. 2010): two bytes, round(127·p) + 128; 0 0 is no
//   gradient oct12    the same with 12 bits, round(2047·p) + 2048, in three bytes: u's low eight bits, u's high four
//   with v's low
//            four above them, v's high eight; 0 0 0 is no gradient
enum class NormalCode { biased8, snorm8, oct8, oct12 };

constexpr int64_t normal_bytes(NormalCode code) noexcept { return code == NormalCode::oct8 ? 2 : 3; }

// dst[z, y, x, :] = code of the vector that `gradient` gives, for each voxel of the slab without its halo. Lengths stay
// within 1e-18 and 1e18, so that their squares are float32 numbers. T: uint8_t, uint16_t, float.
template <typename T>
void normals(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, GradientScale scale, NormalCode code,
             uint8_t* dst, int threads) noexcept;

// Largest product of the factors along z and y: a column of so many sums still fits.
inline constexpr int64_t max_normal_rows = 1 << 16;

// The same for a coarser level: dst[block] = code of the mean of the vectors of a block of `factors` voxels of the slab
// without its halo. A block that hangs over the edge behaves as if the edge voxel were repeated.
//
// A thin sheet inside a block has opposite gradients on its sides, whose sum says nothing. So vectors are also summed
// with the sign that turns them all to one side of the plane x = 0, y = 0 or z = 0, whichever makes their components
// across it longest; where that sum is more than twice as long as the plain one it counts, on the plain one's side.
//
// Sums are of integers, and exact. dst holds ceil(n / factor) blocks along each axis, where n counts no halo. Only the
// last slab of a volume may have a block that hangs over its end. T: uint8_t, uint16_t.
template <typename T>
void coarse_normals(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, Shape3 factors, GradientScale scale,
                    NormalCode code, uint8_t* dst, int threads) noexcept;

}  // namespace volprep
