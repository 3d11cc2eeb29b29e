// Noise-gated extremum over a smooth base: see the header for the formula, separable.hpp for the passes.
#include "volprep/clones.hpp"
#include "volprep/reductions.hpp"
#include "volprep/rounding.hpp"
#include "volprep/separable.hpp"
#include "volprep/separable_mean.hpp"

namespace volprep {
namespace {

template <typename T, typename Sums>
VOLPREP_CLONES void gate_row(const typename Sums::ZYX* sums, const separable::Mean<Sums> mean, const Gate gate,
                             const T* low, const T* high, int64_t cells, T* __restrict dst) noexcept {
    using Real = separable::Real<Sums>;
    const auto from = static_cast<Real>(gate.low * gate.noise);
    const auto width = static_cast<Real>((gate.high - gate.low) * gate.noise);
    const Real per_width = Real{1} / width;
    for (int64_t i = 0; i < cells; ++i) {
        const Real base = mean(sums[i]);
        const Real above = static_cast<Real>(high[i]) - base;
        const Real below = base - static_cast<Real>(low[i]);
        const bool is_above = !(above < below);
        const Real deviation = is_above ? above : -below;
        const Real excess = (is_above ? above : below) - from;
        // Where there is no noise the width is 0: beyond the gate or not, nothing between. NaN is not beyond it.
        const Real ramp = excess < width ? excess * per_width : Real{1};
        const Real t = excess > Real{0} ? ramp : Real{0};
        dst[i] = round_mean<T>(base + t * t * (Real{3} - Real{2} * t) * deviation);
    }
}

template <typename T, typename Sums>
struct Blend {
    static constexpr auto range = separable::Range::cell;
    separable::Mean<Sums> mean;
    Gate gate;

    Blend(const Taps3& taps, const Gate& given) noexcept : mean(taps), gate(given) {}
    bool row(const typename Sums::ZYX* sums, const T* low, const T* high, int64_t cells, T* dst) const noexcept {
        gate_row<T, Sums>(sums, mean, gate, low, high, cells, dst);
        return true;
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
    return threads * separable::scratch_bytes<T>(shape, taps, separable::Range::cell);
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
