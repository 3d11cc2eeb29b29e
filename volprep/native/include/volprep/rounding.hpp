// Rounding that every kernel shares, so that it is the same on every machine.
#pragma once

#include <limits>
#include <type_traits>

namespace volprep {

// The nearest integer, halves to even, for |x| < 2^51: adding 1.5·2^52 leaves no bits for a fraction. std::nearbyint
// says the same, but is a library call per voxel where the CPU has no SSE4.1 (baseline x86-64).
constexpr double round_half_even(double x) noexcept {
    constexpr double shift = 0x1.8p52;
    return (x + shift) - shift;
}

// The same for |x| < 2^22.
constexpr float round_half_even(float x) noexcept {
    constexpr float shift = 0x1.8p23F;
    return (x + shift) - shift;
}

// A mean as a voxel. The NaN of float32 has one spelling: its sign and payload differ between CPUs and operand orders.
template <typename T, typename Real>
constexpr T round_mean(Real mean) noexcept {
    if constexpr (std::is_integral_v<T>) {
        return static_cast<T>(static_cast<int>(round_half_even(mean)));
    } else {
        return mean == mean ? static_cast<T>(mean) : std::numeric_limits<T>::quiet_NaN();
    }
}

}  // namespace volprep
