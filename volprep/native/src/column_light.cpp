// Some columns at a time, which lie beside each other in memory: as many as leave work for each thread.
#include "volprep/column_light.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kFewestColumns = 16;
// Memory gives long rows in time, not short ones far apart: 16 of 120 columns at a time take 1.6 times as long.
constexpr int64_t kMostColumns = 128;
constexpr int64_t kBinsPerPoint = 4;
// Of the samples between two voxels.
constexpr double kPlaces[2] = {0.25, 0.75};
// Below this the opacity, a double, is 1. In a lit head up to a fifth of all samples lie behind such a place.
constexpr double kOpaque = 0x1p-54;

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
class Function {
  public:
    explicit Function(const ControlPoints& points) : knots_(points.count) {
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

struct Beam {
    double light[3] = {0.0, 0.0, 0.0};
    double transmittance = 1.0;

    bool is_opaque() const noexcept { return transmittance < kOpaque; }

    void pass(const Function& function, double value, double length_mm, double brightness = 1.0) noexcept {
        if (is_opaque()) return;
        const Knot& knot = function.below(value);
        const double extinction = knot.at(3, value);
        if (!(extinction > 0.0)) return;
        const double behind = transmittance * std::exp(-length_mm * extinction);
        const double weight = (transmittance - behind) * brightness;
        for (int c = 0; c < 3; ++c) light[c] += weight * knot.at(c, value);
        transmittance = behind;
    }
};

}  // namespace

void column_light(const Columns& columns, const ControlPoints& points, double* light, int threads) {
    const Function function(points);
    const int64_t of_thread = (columns.count + resolve_threads(threads) - 1) / resolve_threads(threads);
    const int64_t together = std::clamp(of_thread, kFewestColumns, kMostColumns);
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t begin = 0; begin < columns.count; begin += together) {
        const int64_t beside = std::min(together, columns.count - begin);
        Beam beams[kMostColumns];
        const double* const spacing_mm = columns.spacings_mm + begin;
        for (int64_t voxel = 0; voxel < columns.voxels; ++voxel) {
            const double* const near = columns.values + voxel * columns.count + begin;
            const double* const far = near + columns.count;
            const double* const lit =
                columns.brightness == nullptr ? nullptr : columns.brightness + voxel * columns.count + begin;
            const bool is_first = voxel == 0, is_last = voxel + 1 == columns.voxels;
            for (int64_t i = 0; i < beside; ++i) {
                if (columns.nearest) {
                    beams[i].pass(function, near[i], spacing_mm[i], lit == nullptr ? 1.0 : lit[i]);
                    continue;
                }
                const double half_mm = spacing_mm[i] / 2;
                // Half a voxel lies outside the first and the last centre.
                if (is_first) beams[i].pass(function, near[i], half_mm);
                for (int k = 0; !is_last && k < 2; ++k) {
                    beams[i].pass(function, near[i] + kPlaces[k] * (far[i] - near[i]), half_mm);
                }
                if (is_last) beams[i].pass(function, near[i], half_mm);
            }
            if (std::all_of(beams, beams + beside, [](const Beam& beam) { return beam.is_opaque(); })) break;
        }
        for (int64_t i = 0; i < beside; ++i) {
            std::copy_n(beams[i].light, 3, light + 4 * (begin + i));
            light[4 * (begin + i) + 3] = 1.0 - beams[i].transmittance;
        }
    }
}

}  // namespace volprep
