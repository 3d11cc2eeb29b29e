// Averaging of transmittance over the columns of a block, along three axes: see the header.
#include <algorithm>
#include <array>
#include <cmath>

#include "volprep/reductions.hpp"
#include "volprep/rounding.hpp"

namespace volprep {
namespace {

using Colour = std::array<double, 3>;

double number(uint8_t value) noexcept { return value / 255.0; }
double number(float value) noexcept { return double{value}; }

template <typename T>
T stored(double value) noexcept {
    const double limited = std::clamp(value, 0.0, 1.0);
    return round_mean<T>(std::is_integral_v<T> ? limited * 255.0 : limited);
}

// (1 − opacity)^exponent: a table for bytes.
template <typename T>
class Transmittance {
  public:
    explicit Transmittance(double exponent) noexcept : exponent_(exponent) {}
    double operator()(T opacity) const noexcept { return std::pow(1.0 - number(opacity), exponent_); }

  private:
    double exponent_;
};

template <>
class Transmittance<uint8_t> {
  public:
    explicit Transmittance(double exponent) noexcept {
        for (int opacity = 0; opacity < 256; ++opacity) {
            table_[opacity] = std::pow(1.0 - opacity / 255.0, exponent);
        }
    }
    double operator()(uint8_t opacity) const noexcept { return table_[opacity]; }

  private:
    std::array<double, 256> table_;
};

// One way of crossing a block: steps in voxels, and how many of them.
template <typename T>
struct Axis {
    int64_t length;
    double to_reference;  // exponent from the length of the block to the reference length
    Transmittance<T> through_voxel;
};

struct Light {
    double transmittance = 0.0;
    Colour colour = {};
};

template <typename T>
class Reducer {
  public:
    Reducer(const T* src, Shape3 shape, Shape3 factors, const Spacing3& spacing, double reference) noexcept
        : src_(src),
          shape_(shape),
          factors_(factors),
          axes_{axis(factors.z, spacing.z, reference), axis(factors.y, spacing.y, reference),
                axis(factors.x, spacing.x, reference)} {}

    void reduce(Shape3 block, T* dst) const noexcept {
        double opacity = 0.0;
        Colour colour = {};
        for (int index = 0; index < 3; ++index) {
            const Light light = crossing(block, index);
            const double own = 1.0 - std::pow(light.transmittance, axes_[index].to_reference);
            opacity += own;
            const double crossed = 1.0 - light.transmittance;
            for (int channel = 0; channel < 3 && crossed > 0.0; ++channel) {
                colour[channel] += own * light.colour[channel] / crossed;
            }
        }
        const Colour plain = opacity > 0.0 ? Colour{} : mean_colour(block);
        for (int channel = 0; channel < 3; ++channel) {
            dst[channel] = stored<T>(opacity > 0.0 ? colour[channel] / opacity : plain[channel]);
        }
        dst[3] = stored<T>(opacity / 3.0);
    }

  private:
    static Axis<T> axis(int64_t factor, double spacing, double reference) noexcept {
        return {factor, reference / (static_cast<double>(factor) * spacing), Transmittance<T>(spacing / reference)};
    }

    const T* voxel(const std::array<int64_t, 3>& zyx) const noexcept {
        const int64_t z = std::min(zyx[0], shape_.z - 1);
        const int64_t y = std::min(zyx[1], shape_.y - 1);
        const int64_t x = std::min(zyx[2], shape_.x - 1);
        return src_ + 4 * ((z * shape_.y + y) * shape_.x + x);
    }

    // Mean over the columns of a block along an axis, and over both directions.
    Light crossing(Shape3 block, int along) const noexcept {
        const std::array<int64_t, 3> factors = {factors_.z, factors_.y, factors_.x};
        const std::array<int64_t, 3> first = {block.z * factors_.z, block.y * factors_.y, block.x * factors_.x};
        const int side0 = along == 0 ? 1 : 0;
        const int side1 = along == 2 ? 1 : 2;
        Light total;
        for (int64_t i = 0; i < factors[side0]; ++i) {
            for (int64_t j = 0; j < factors[side1]; ++j) {
                std::array<int64_t, 3> at = first;
                at[side0] += i;
                at[side1] += j;
                const Light column = through(at, along);
                total.transmittance += column.transmittance;
                for (int channel = 0; channel < 3; ++channel) {
                    total.colour[channel] += column.colour[channel];
                }
            }
        }
        const auto columns = static_cast<double>(factors[side0] * factors[side1]);
        total.transmittance /= columns;
        for (double& channel : total.colour) {
            channel /= columns;
        }
        return total;
    }

    // Seen from the front a voxel's light is dimmed by the voxels before it, seen from the back by the voxels behind
    // it.
    Light through(std::array<int64_t, 3> at, int along) const noexcept {
        Light front{1.0, {}};
        Colour back = {};
        for (int64_t k = 0; k < axes_[along].length; ++k, ++at[along]) {
            const T* const rgba = voxel(at);
            const double kept = axes_[along].through_voxel(rgba[3]);
            for (int channel = 0; channel < 3; ++channel) {
                const double own = number(rgba[channel]) * (1.0 - kept);
                front.colour[channel] += own * front.transmittance;
                back[channel] = back[channel] * kept + own;
            }
            front.transmittance *= kept;
        }
        for (int channel = 0; channel < 3; ++channel) {
            front.colour[channel] = (front.colour[channel] + back[channel]) / 2.0;
        }
        return front;
    }

    Colour mean_colour(Shape3 block) const noexcept {
        Colour sum = {};
        for (int64_t k = 0; k < factors_.voxels(); ++k) {
            const T* const rgba =
                voxel({block.z * factors_.z + k / factors_.slice(), block.y * factors_.y + k / factors_.x % factors_.y,
                       block.x * factors_.x + k % factors_.x});
            for (int channel = 0; channel < 3; ++channel) {
                sum[channel] += number(rgba[channel]) / static_cast<double>(factors_.voxels());
            }
        }
        return sum;
    }

    const T* src_;
    Shape3 shape_;
    Shape3 factors_;
    std::array<Axis<T>, 3> axes_;
};

}  // namespace

template <typename T>
void rgba_reduce(const T* src, Shape3 shape, Shape3 factors, const Spacing3& spacing_mm, double reference_mm, T* dst,
                 int threads) noexcept {
    const Shape3 reduced = reduced_shape(shape, factors);
    const Reducer<T> reducer(src, shape, factors, spacing_mm, reference_mm);
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t index = 0; index < reduced.voxels(); ++index) {
        reducer.reduce({index / reduced.slice(), index / reduced.x % reduced.y, index % reduced.x}, dst + 4 * index);
    }
}

template void rgba_reduce(const uint8_t*, Shape3, Shape3, const Spacing3&, double, uint8_t*, int) noexcept;
template void rgba_reduce(const float*, Shape3, Shape3, const Spacing3&, double, float*, int) noexcept;

}  // namespace volprep
