// Noise-gated extremum over a smooth base: see the header for the formula, separable.hpp for the passes.
#include "volprep/feature_reduce.hpp"

#include "volprep/rounding.hpp"
#include "volprep/separable.hpp"

namespace volprep {
namespace {

template <typename T, typename Sums>
VOLPREP_CLONES void gate_row(const typename Sums::ZYX* sums, const separable::Mean<Sums> mean, const Gate gate,
                             const T* low, const T* high, int64_t cells, T* __restrict dst) noexcept {
    const double from = gate.low * gate.noise;
    const double width = (gate.high - gate.low) * gate.noise;
    const double per_width = 1.0 / width;
    for (int64_t i = 0; i < cells; ++i) {
        const double base = mean(sums[i]);
        const double above = static_cast<double>(high[i]) - base;
        const double below = base - static_cast<double>(low[i]);
        const bool is_above = !(above < below);
        const double deviation = is_above ? above : -below;
        const double excess = (is_above ? above : below) - from;
        // Where there is no noise the width is 0: beyond the gate or not, nothing between. NaN is not beyond it.
        const double ramp = excess < width ? excess * per_width : 1.0;
        const double t = excess > 0.0 ? ramp : 0.0;
        dst[i] = round_mean<T>(base + t * t * (3.0 - 2.0 * t) * deviation);
    }
}

template <typename T, typename Sums>
struct Blend {
    static constexpr bool ranged = true;
    separable::Mean<Sums> mean;
    Gate gate;

    Blend(const Taps3& taps, const Gate& given) noexcept : mean(taps), gate(given) {}
    static constexpr separable::Window window(const Taps& taps) noexcept {
        return {taps.reach(), taps.reach() + taps.factor};
    }
    void row(const typename Sums::ZYX* sums, const T* low, const T* high, int64_t cells, T* dst) const noexcept {
        gate_row<T, Sums>(sums, mean, gate, low, high, cells, dst);
    }
};

}  // namespace

template <typename T>
void feature_reduce(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, const Gate& gate, T* dst,
                    int64_t slices, std::byte* scratch, int threads) noexcept {
    separable::reduce<T, Blend>(src, shape, place, taps, dst, slices, scratch, threads, gate);
}

template <typename T>
int64_t feature_reduce_scratch(Shape3 shape, const Taps3& taps, int threads) noexcept {
    return threads * separable::scratch_bytes<T>(shape, taps, true);
}

#define VOLPREP_INSTANCE(T)                                                                                  \
    template void feature_reduce(const T*, Shape3, const SlabPlace&, const Taps3&, const Gate&, T*, int64_t, \
                                 std::byte*, int) noexcept;                                                  \
    template int64_t feature_reduce_scratch<T>(Shape3, const Taps3&, int) noexcept;
VOLPREP_INSTANCE(uint8_t)
VOLPREP_INSTANCE(int16_t)
VOLPREP_INSTANCE(uint16_t)
VOLPREP_INSTANCE(float)
#undef VOLPREP_INSTANCE

}  // namespace volprep
