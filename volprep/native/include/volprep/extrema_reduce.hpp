// The least and the greatest voxel of each block: two levels that bound every other one.
#pragma once

#include <algorithm>
#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep {

// Voxels of a row, in whole blocks, that are folded together: scratch memory that a thread needs.
constexpr int64_t extrema_run(Shape3 factors) noexcept { return std::max<int64_t>(1, 4096 / factors.x) * factors.x; }

// dst_min[k], dst_max[k] = the least and the greatest of the voxels of block k. Either may be null: it is not written.
// float32 in the order of float_order.hpp: −0 is less than +0, and a NaN with a sign less, one without greater than
// all. factors >= 1 with a product of at most max_block_voxels; scratch: extrema_run(factors) voxels for each thread;
// threads >= 1. T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void extrema_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst_min, T* dst_max, T* scratch,
                    int threads) noexcept;

}  // namespace volprep
