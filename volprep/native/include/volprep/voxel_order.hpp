// The order in which voxels of every type are compared: integers as they are, float32 as its order key.
#pragma once

#include "volprep/float_order.hpp"

namespace volprep {

template <typename T>
struct VoxelOrder {
    using Key = T;
    static T key(T value) noexcept { return value; }
    static T value(T key) noexcept { return key; }
};

template <>
struct VoxelOrder<float> {
    using Key = int32_t;
    static int32_t key(float value) noexcept { return order_key(value); }
    static float value(int32_t key) noexcept { return from_order_key(key); }
};

// By value, not std::min: references to array elements keep the compiler from vectorising.
template <typename Key>
Key lesser(Key a, Key b) noexcept {
    return b < a ? b : a;
}
template <typename Key>
Key greater(Key a, Key b) noexcept {
    return a < b ? b : a;
}

}  // namespace volprep
