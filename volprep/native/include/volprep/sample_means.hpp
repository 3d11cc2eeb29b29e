// Means over blocks of level 0, of the values and of what transfer functions make of them: what coarse levels are
// fitted to, in place of every voxel.
#pragma once

#include <cstdint>

#include "volprep/fit_level.hpp"
#include "volprep/shape.hpp"

namespace volprep {

// values[k] = mean of v · bins_per_code, and looks of k = mean of F[nearest bin], over the voxels v of block k.
// A block that hangs over the edge has those inside. Values are summed exactly. Looks are summed in float32: rows from
// left to right, then the rows in order of z and y. T: uint8_t, uint16_t.
template <typename T>
void sample_means(const Codes<T>& src, Shape3 shape, Shape3 factors, int64_t functions, int64_t bins,
                  const float* table, float* values, float* looks, int threads) noexcept;

}  // namespace volprep
