// Voxels compared as unsigned integers, in a total order: what kernels sort and select by.
#pragma once

#include <cstdint>

#include "volprep/float_order.hpp"

namespace volprep {

template <typename T>
struct Sorted;

template <>
struct Sorted<uint8_t> {
    using Key = uint8_t;
    static constexpr Key key(uint8_t value) noexcept { return value; }
    static constexpr uint8_t value(Key key) noexcept { return key; }
};

template <>
struct Sorted<uint16_t> {
    using Key = uint16_t;
    static constexpr Key key(uint16_t value) noexcept { return value; }
    static constexpr uint16_t value(Key key) noexcept { return key; }
};

template <>
struct Sorted<int16_t> {
    using Key = uint16_t;
    static constexpr Key key(int16_t value) noexcept { return static_cast<Key>(value ^ 0x8000); }
    static constexpr int16_t value(Key key) noexcept { return static_cast<int16_t>(key ^ 0x8000); }
};

template <>
struct Sorted<float> {
    using Key = uint32_t;
    static constexpr Key key(float value) noexcept { return static_cast<Key>(order_key(value)) ^ 0x80000000U; }
    static constexpr float value(Key key) noexcept { return from_order_key(static_cast<int32_t>(key ^ 0x80000000U)); }
};

}  // namespace volprep
