// float32 compared as integers: a total order without branches, in which minimum and maximum do not depend on the order
// of the voxels, as they would with NaN and with −0 = +0.
#pragma once

#include <bit>
#include <cstdint>

namespace volprep {

// Ascends with the value: −NaN < −inf < … < −0 < +0 < … < +inf < +NaN.
constexpr int32_t order_key(float value) noexcept {
    const auto bits = std::bit_cast<int32_t>(value);
    return bits ^ ((bits >> 31) & 0x7fffffff);
}

constexpr float from_order_key(int32_t key) noexcept { return std::bit_cast<float>(key ^ ((key >> 31) & 0x7fffffff)); }

}  // namespace volprep
