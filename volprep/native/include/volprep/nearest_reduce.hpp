// One voxel of each block.
#pragma once

#include "volprep/box_reduce.hpp"

namespace volprep {

// dst[k] = voxel k · factor + factor / 2 along each axis, or the last one where that lies outside: the one that
// GL_NEAREST takes at the centre of the block. Of an even number of voxels it is the upper of the two beside the
// centre, so that the picture moves by half a voxel of src. factors >= 1; threads >= 1. T: uint8_t, int16_t, uint16_t,
// float.
template <typename T>
void nearest_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, int threads) noexcept;

}  // namespace volprep
