// Sizes of volumes, as every kernel takes them.
#pragma once

#include <cstdint>

namespace volprep {

// Number of voxels along each axis of a C-order [z, y, x] volume. x is the fastest axis.
struct Shape3 {
    int64_t z;
    int64_t y;
    int64_t x;

    constexpr int64_t voxels() const noexcept { return z * y * x; }
    constexpr int64_t slice() const noexcept { return y * x; }
};

// Blocks of `factor` voxels that cover `voxels` of them; the last one may hang over the edge.
constexpr int64_t reduced_length(int64_t voxels, int64_t factor) noexcept { return (voxels + factor - 1) / factor; }

// The shape of dst: ceil(n / factor) along each axis.
constexpr Shape3 reduced_shape(Shape3 shape, Shape3 factors) noexcept {
    return {reduced_length(shape.z, factors.z), reduced_length(shape.y, factors.y), reduced_length(shape.x, factors.x)};
}

}  // namespace volprep
