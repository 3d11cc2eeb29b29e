// The range of each row and each column of every slice: from these follow the ranges of all planes across any axis.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// row_low, row_high [z, y] = the least and greatest voxel of each row; column_low, column_high [z, x] = the same for
// each column of a slice. float32 is compared as in float_order.hpp: −0 is less than +0, a NaN with a sign less than
// −inf, one without greater than +inf, so that no voxel that is not finite stays hidden. T: uint8_t, int16_t, uint16_t,
// float.
template <typename T>
void slice_ranges(const T* src, Shape3 shape, T* row_low, T* row_high, T* column_low, T* column_high,
                  int threads) noexcept;

}  // namespace volprep
