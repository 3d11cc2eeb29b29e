// The median of each block.
#pragma once

#include "volprep/blocks.hpp"

namespace volprep {

// dst[k] = the median of the voxels of block k; of an even number of voxels the mean of the middle two: the lower one
// alone would darken noise. Integers: rounded half to even; float32: the mean in double, rounded. float32 is sorted in
// the order of float_order.hpp. factors >= 1 with a product of at most max_block_voxels; scratch:
// block_scratch(factors) voxels for each thread; threads >= 1. T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void median_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, T* scratch, int threads) noexcept;

}  // namespace volprep
