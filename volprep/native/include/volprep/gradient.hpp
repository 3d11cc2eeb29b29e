// Gradients of a volume: which differences are taken, and how a slab of a longer volume says where it ends.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// A component is a difference along its own axis, smoothed over the 3×3 voxels across it. Weights of the corner, the
// edge and the centre of these nine, and the divisor that makes the slope of a ramp of the sum:
//   forward   f(1) − f(0), backward at the last voxel             1
//   central   f(1) − f(−1)                                        2
//   thesis    central with 1 3 1 / 3 6 3 / 1 3 1                 44   (mobile volume rendering thesis, 3.1)
//   sobel     central with (1 2 1) ⊗ (1 2 1)                     32
//   isotropic central with (1 4 1) ⊗ (1 4 1): 4th order in angle  72
enum class GradientKernel { forward, central, thesis, sobel, isotropic };

// The slab is a part of a volume. Where it has a halo its first or last slice belongs to the neighbour: it is read, and
// no gradient is made for it. Where it has none the volume ends there.
struct Halo {
    bool below;
    bool above;

    constexpr int64_t slices() const noexcept { return int64_t{below} + int64_t{above}; }
};

// Factors of the sums of differences along x, y and z, which give a vector of the wanted unit.
struct GradientScale {
    float x;
    float y;
    float z;
};

// dst[z, y, x, :] = scale · sums at each voxel of the slab without its halo. At the border of the volume the
// difference along the axis is one-sided, and voxels outside repeat the voxel at the edge; an axis of one voxel has no
// slope. Sums of integers are exact; sums of float32 are rounded in a fixed order. T: uint8_t, uint16_t, float.
template <typename T>
void gradient(const T* src, Shape3 shape, Halo halo, GradientKernel kernel, GradientScale scale, float* dst,
              int threads) noexcept;

}  // namespace volprep
