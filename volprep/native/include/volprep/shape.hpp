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

}  // namespace volprep
