// Means over blocks of level 0, of the values and of what transfer functions make of them: what coarse levels are
// fitted to, in place of every voxel.
#pragma once

#include <cstdint>

#include "volprep/fit_level.hpp"
#include "volprep/shape.hpp"

namespace volprep {

// values[k] = mean of v · bins_per_code over the voxels v of block k, summed exactly. looks of k = mean of F[nearest
// bin] over the rows of block k in which z - y, from the block's first voxel, is a multiple of the smaller of factors.z
// and factors.y: each slice and each height has the same number of them. They are summed in float32: rows from left
// to right, then the rows in order of z and y. A block that hangs over the edge has the voxels inside. T: uint8_t,
// uint16_t.
template <typename T>
void sample_means(const Codes<T>& src, Shape3 shape, Shape3 factors, int64_t functions, int64_t bins,
                  const float* table, float* values, float* looks, int threads) noexcept;

}  // namespace volprep
