// Random numbers for paths of light: one stream for each path, so that the result does not depend on threads.
//
// The generator is SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014). A
// stream starts at a mix of seed and index; 2^40 numbers of 2^32 streams overlap with a chance of about 2^-8 for any
// one pair in the whole run, and an overlap changes no expected value.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace volprep::light {

inline uint64_t mixed(uint64_t state) noexcept {
    state = (state ^ (state >> 30)) * 0xBF58476D1CE4E5B9u;
    state = (state ^ (state >> 27)) * 0x94D049BB133111EBu;
    return state ^ (state >> 31);
}

// Natural logarithm of a positive normal number, with an error below 1e-15 of max(1, |log x|). The C library's differs
// between machines in the last bit; this one does not, because it uses only operations that IEEE 754 rounds.
inline double logarithm(double x) noexcept {
    constexpr double kLog2 = 0.693147180559945309417;
    constexpr uint64_t kFraction = (uint64_t{1} << 52) - 1;
    const uint64_t bits = std::bit_cast<uint64_t>(x);
    int64_t exponent = static_cast<int64_t>(bits >> 52) - 1023;
    double mantissa = std::bit_cast<double>((bits & kFraction) | (uint64_t{1023} << 52));
    if (mantissa > 1.4142135623730951) {
        mantissa *= 0.5;
        ++exponent;
    }
    // log m = 2 artanh((m - 1) / (m + 1)), and |s| <= 0.1716.
    const double s = (mantissa - 1.0) / (mantissa + 1.0);
    const double q = s * s;
    double sum = 1.0 / 21.0;
    for (int odd = 19; odd >= 1; odd -= 2) sum = sum * q + 1.0 / odd;
    return static_cast<double>(exponent) * kLog2 + 2.0 * s * sum;
}

class Stream {
  public:
    Stream(uint64_t seed, uint64_t index) noexcept
        : state_(mixed(mixed(seed + 0x9E3779B97F4A7C15u) ^ (index * 0xD1B54A32D192ED03u + 0x8CB92BA72F3D8DD7u))) {}

    // Uniform in [0, 1), a multiple of 2^-53.
    double uniform() noexcept { return static_cast<double>(next() >> 11) * 0x1p-53; }

    // Optical depth to the next event: exponential with mean 1.
    double depth() noexcept { return -logarithm(static_cast<double>((next() >> 11) + 1) * 0x1p-53); }

    // Uniform on the unit sphere (Marsaglia, "Choosing a point from the surface of a sphere", 1972).
    void direction(double out[3]) noexcept {
        double a = 0.0;
        double b = 0.0;
        double square = 2.0;
        while (square >= 1.0) {
            a = 2.0 * uniform() - 1.0;
            b = 2.0 * uniform() - 1.0;
            square = a * a + b * b;
        }
        const double factor = 2.0 * std::sqrt(1.0 - square);
        out[0] = a * factor;
        out[1] = b * factor;
        out[2] = 1.0 - 2.0 * square;
    }

  private:
    uint64_t next() noexcept {
        state_ += 0x9E3779B97F4A7C15u;
        return mixed(state_);
    }
    uint64_t state_;
};

}  // namespace volprep::light
