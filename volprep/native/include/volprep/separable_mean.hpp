// The mean of a sum of a separable filter, as a real number or rounded.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>

#include "volprep/separable_rows.hpp"
#include "volprep/taps.hpp"

namespace volprep::separable {

// The sum of the weights of all three axes: what a sum is divided by. A power of two, so that its reciprocal is exact.
inline double divisor(const Taps3& taps) noexcept {
    return static_cast<double>(taps.z.sum()) * static_cast<double>(taps.y.sum()) * static_cast<double>(taps.x.sum());
}

// Type of means: where float holds every sum, a vector holds twice the number.
template <typename Sums>
using Real = std::conditional_t<std::is_same_v<Sums, ShortSums>, float, double>;

// The mean of a sum that had its bias taken off.
template <typename Sums>
struct Mean {
    Real<Sums> scale;
    Real<Sums> bias = Sums::bias;

    explicit Mean(const Taps3& taps) noexcept : scale(static_cast<Real<Sums>>(1.0 / divisor(taps))) {}
    Real<Sums> operator()(typename Sums::ZYX sum) const noexcept { return static_cast<Real<Sums>>(sum) * scale + bias; }
};

// The same, rounded half to even: adding half less one, or half where the floor is odd, carries exactly when it must.
struct RoundedMean {
    int32_t shift;
    int32_t bias;
    int32_t half;
    int32_t odd;

    template <typename Sums>
    static RoundedMean of(const Taps3& taps) noexcept {
        const auto total = static_cast<int32_t>(divisor(taps));
        return {std::countr_zero(static_cast<uint32_t>(total)), Sums::bias * total, std::max(total / 2 - 1, 0),
                total > 1 ? 1 : 0};
    }
    int32_t operator()(int32_t sum) const noexcept {
        const int32_t whole = sum + bias;
        return (whole + half + ((whole >> shift) & odd)) >> shift;
    }
};

}  // namespace volprep::separable
