// Separable linear filters: see the header for the arithmetic, separable.hpp for the passes.
#include <limits>

#include "volprep/clones.hpp"
#include "volprep/reductions.hpp"
#include "volprep/rounding.hpp"
#include "volprep/separable.hpp"
#include "volprep/separable_mean.hpp"

namespace volprep {
namespace {

// Integers whose sums fit int32 are rounded in it, all others in double.
template <typename Sums>
using MeanOf =
    std::conditional_t<std::is_integral_v<typename Sums::ZYX>, separable::RoundedMean, separable::Mean<Sums>>;

template <typename Sums>
MeanOf<Sums> mean_of(const Taps3& taps) noexcept {
    if constexpr (std::is_integral_v<typename Sums::ZYX>) {
        return separable::RoundedMean::of<Sums>(taps);
    } else {
        return separable::Mean<Sums>(taps);
    }
}

template <typename T, typename Value>
T voxel(Value value, Value lowest, Value highest) noexcept {
    const Value limited = value < lowest ? lowest : highest < value ? highest : value;
    if constexpr (std::is_integral_v<Value>) {
        return static_cast<T>(limited);
    } else {
        return round_mean<T>(limited);
    }
}

template <typename T, typename Sum, typename Mean>
VOLPREP_CLONES void round_row(const Sum* sums, const Mean mean, int64_t cells, T* __restrict dst) noexcept {
    using Limits = std::numeric_limits<T>;
    constexpr auto infinity = std::numeric_limits<double>::infinity();
    constexpr auto lowest = std::is_integral_v<T> ? static_cast<Sum>(Limits::lowest()) : static_cast<Sum>(-infinity);
    constexpr auto highest = std::is_integral_v<T> ? static_cast<Sum>(Limits::max()) : static_cast<Sum>(infinity);
    for (int64_t i = 0; i < cells; ++i) {
        dst[i] = voxel<T, Sum>(mean(sums[i]), lowest, highest);
    }
}

// Whether nothing had to be limited.
template <typename T, typename Sum, typename Mean>
VOLPREP_CLONES bool clamp_row(const Sum* sums, const Mean mean, const T* low, const T* high, int64_t cells,
                              T* __restrict dst) noexcept {
    int outside = 0;
    for (int64_t i = 0; i < cells; ++i) {
        const auto value = mean(sums[i]);
        const Sum lowest = low[i];
        const Sum highest = high[i];
        outside |= static_cast<int>(value < lowest) | static_cast<int>(highest < value);
        dst[i] = voxel<T, Sum>(value, lowest, highest);
    }
    return outside == 0;
}

template <typename T, typename Sums>
struct Round {
    static constexpr auto range = separable::Range::none;
    MeanOf<Sums> mean;

    explicit Round(const Taps3& taps) noexcept : mean(mean_of<Sums>(taps)) {}
    bool row(const typename Sums::ZYX* sums, const T*, const T*, int64_t cells, T* dst) const noexcept {
        round_row(sums, mean, cells, dst);
        return true;
    }
};

template <typename T, typename Sums>
struct Clamp {
    static constexpr auto range = separable::Range::clamps;
    MeanOf<Sums> mean;

    explicit Clamp(const Taps3& taps) noexcept : mean(mean_of<Sums>(taps)) {}
    bool row(const typename Sums::ZYX* sums, const T* low, const T* high, int64_t cells, T* dst) const noexcept {
        return clamp_row(sums, mean, low, high, cells, dst);
    }
};

}  // namespace

template <typename T>
void linear_reduce(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, bool clamp, T* dst,
                   int64_t slices, std::byte* scratch, int threads) noexcept {
    if (clamp) {
        separable::reduce<T, Clamp>(src, shape, place, taps, dst, slices, scratch, threads);
    } else {
        separable::reduce<T, Round>(src, shape, place, taps, dst, slices, scratch, threads);
    }
}

template <typename T>
int64_t linear_reduce_scratch(Shape3 shape, const Taps3& taps, bool clamp, int threads) noexcept {
    using separable::Range;
    return threads * separable::scratch_bytes<T>(shape, taps, clamp ? Range::clamps : Range::none);
}

#define VOLPREP_INSTANCE(T)                                                                                      \
    template void linear_reduce(const T*, Shape3, const SlabPlace&, const Taps3&, bool, T*, int64_t, std::byte*, \
                                int) noexcept;                                                                   \
    template int64_t linear_reduce_scratch<T>(Shape3, const Taps3&, bool, int) noexcept;
VOLPREP_INSTANCE(uint8_t)
VOLPREP_INSTANCE(int16_t)
VOLPREP_INSTANCE(uint16_t)
VOLPREP_INSTANCE(float)
#undef VOLPREP_INSTANCE

}  // namespace volprep
