// A ray on its way through samples, front to back, and transfer functions that are searched fast.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "volprep/rays.hpp"

namespace volprep {

// Bins of values for each control point.
constexpr int64_t kBinsPerPoint = 4;

// A control point, and how the function rises from it to the next.
struct Knot {
    double value;
    double entry[4];  // colour and extinction
    double slope[4];

    double at(int channel, double place) const noexcept {
        return place == value ? entry[channel] : slope[channel] * (place - value) + entry[channel];
    }
};

// A transfer function, and for each of many bins of values the point to begin at in search of one.
class ControlFunction {
  public:
    explicit ControlFunction(const ControlPoints& points) : knots_(points.count) {
        for (std::size_t i = 0; i < knots_.size(); ++i) {
            knots_[i].value = points.values[i];
            std::copy_n(points.colours + 3 * i, 3, knots_[i].entry);
            knots_[i].entry[3] = points.extinctions_per_mm[i];
            // Of the last one, and of those below a jump: never used.
            std::fill_n(knots_[i].slope, 4, 0.0);
        }
        for (std::size_t i = 0; i + 1 < knots_.size(); ++i) {
            const double width = knots_[i + 1].value - knots_[i].value;
            for (int c = 0; width > 0.0 && c < 4; ++c) {
                knots_[i].slope[c] = (knots_[i + 1].entry[c] - knots_[i].entry[c]) / width;
            }
        }
        const double range = knots_.back().value - knots_.front().value;
        const int64_t bins = kBinsPerPoint * points.count;
        bins_per_unit_ = range > 0.0 ? static_cast<double>(bins) / range : 0.0;
        std::size_t point = 0;
        for (int64_t bin = 0; bin <= bins; ++bin) {
            const double from = knots_.front().value + range * (static_cast<double>(bin) / static_cast<double>(bins));
            while (point + 1 < knots_.size() && knots_[point + 1].value <= from) ++point;
            // One earlier: rounding may put a value into the next bin.
            starts_.push_back(point > 0 ? point - 1 : 0);
        }
    }

    // The last point that is not above a value. Beyond the ends the function is that of the outermost points, to whose
    // values `value` is brought: below a jump at the first one, its lower side.
    const Knot& below(double& value) const noexcept {
        if (value < knots_.front().value) {
            value = knots_.front().value;
            return knots_.front();
        }
        value = std::min(value, knots_.back().value);
        std::size_t point = starts_[static_cast<std::size_t>((value - knots_.front().value) * bins_per_unit_)];
        while (point + 1 < knots_.size() && knots_[point + 1].value <= value) ++point;
        return knots_[point];
    }

  private:
    std::vector<Knot> knots_;
    std::vector<std::size_t> starts_;
    double bins_per_unit_ = 0.0;
};

// Below this the opacity, a double, is 1. In a lit head up to a fifth of all samples lie behind such a place.
constexpr double kOpaque = 0x1p-54;

struct Beam {
    double light[3] = {0.0, 0.0, 0.0};
    double transmittance = 1.0;

    bool is_opaque() const noexcept { return transmittance < kOpaque; }

    // Passes a medium; `colour` says its colour by channel.
    template <typename Colour>
    void pass(double extinction, double length_mm, double brightness, const Colour& colour) noexcept {
        const double behind = transmittance * std::exp(-length_mm * extinction);
        const double weight = (transmittance - behind) * brightness;
        for (int c = 0; c < 3; ++c) light[c] += weight * colour(c);
        transmittance = behind;
    }

    void write(double* rgba) const noexcept {
        std::copy_n(light, 3, rgba);
        rgba[3] = 1.0 - transmittance;
    }
};

}  // namespace volprep
