// A coarse level as the field between whose voxels the values of level 0 are missed least. The method is volprep's own.
#pragma once

#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep {

// Improves `level`, float32 with reduced_shape(shape, factors), `iterations` times. With u the trilinear field
// of the level at a voxel of level 0 or a mean of some (outside its outer centres: their value) and v its value, each
// voxel of the level moves by
//   step · Σ h (v - u) / Σ h
// over the voxels on which it has influence h, and stays within 0 and `largest`. Equals fit_level without looks, in a
// quarter of the time for 2 × 2 × 2 voxels and a tenth for 4 × 4 × 4: Σ h v is the same in each iteration, and Σ h u is
// a sum over neighbours in the level. After n iterations a voxel depends on data up to n voxels of the level away, so
// that slabs of whole cells with a margin of n voxels give the same level. The sums do not depend on the number of
// threads. T: uint8_t, uint16_t, float.
template <typename T>
void fit_values(const T* src, Shape3 shape, Shape3 factors, float largest, int iterations, float step, float* level,
                int threads) noexcept;

}  // namespace volprep
