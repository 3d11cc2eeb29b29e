// The range of a float32 volume, and what in it is not a number.
#pragma once

#include <cstdint>

namespace volprep {

// minimum and maximum of the finite voxels, zero always as +0; (+inf, −inf) without any.
struct ValueRange {
    float minimum;
    float maximum;
    int64_t nan;
    int64_t negative_infinite;
    int64_t positive_infinite;
};

ValueRange value_range(const float* src, int64_t voxels, int threads) noexcept;

}  // namespace volprep
