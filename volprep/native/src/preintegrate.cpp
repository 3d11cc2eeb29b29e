// Pre-integration: see the header.
//
// A segment is cut where its value crosses a control point. On a piece of u = 0..1 extinction and colour are linear,
// so that the optical depth T(u) is a quadratic, and the light is
//     c(0) (1 − exp(−T(1))) + (c(1) − c(0)) ∫ u T'(u) exp(−T(u)) du.
// The integral has a closed form (error function or Dawson's integral), which loses all digits where the extinction is
// nearly constant; Gauss' rule on parts of at most half an optical depth keeps them.
#include "volprep/preintegrate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace volprep {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// What is behind 40 optical depths adds 4e-18.
constexpr double kDark = 40.0;
// Light below this has lost digits to underflow.
constexpr double kNothing = 1e-200;
constexpr int kNodes = 5;
constexpr double kNode[kNodes] = {0.04691007703066800, 0.23076534494715845, 0.5, 0.76923465505284155,
                                  0.95308992296933200};
constexpr double kWeight[kNodes] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324,
                                    0.11846344252809454};

// The function where it is linear: from low to high, ends as the inside sees them.
struct Part {
    double low, high;
    double entry[2][4];  // colour and extinction at low and at high
};

void set_end(double* entry, const ControlPoints& points, int64_t i) {
    std::copy_n(points.colours + 3 * i, 3, entry);
    entry[3] = points.extinctions_per_mm[i];
}

std::vector<Part> linear_parts(const ControlPoints& points) {
    std::vector<Part> parts;
    const auto add = [&](double low, double high, int64_t from, int64_t to) {
        Part part{low, high, {}};
        set_end(part.entry[0], points, from);
        set_end(part.entry[1], points, to);
        parts.push_back(part);
    };
    const int64_t last = points.count - 1;
    add(-kInfinity, points.values[0], 0, 0);
    for (int64_t i = 0; i < last; ++i) {
        if (points.values[i] < points.values[i + 1]) add(points.values[i], points.values[i + 1], i, i + 1);
    }
    add(points.values[last], kInfinity, last, last);
    return parts;
}

void evaluate(const Part& part, double value, double* entry) {
    if (!std::isfinite(part.low) || !std::isfinite(part.high)) {
        std::copy_n(part.entry[0], 4, entry);
        return;
    }
    const double share = (value - part.low) / (part.high - part.low);
    for (int i = 0; i < 4; ++i) entry[i] = part.entry[0][i] + share * (part.entry[1][i] - part.entry[0][i]);
}

// ∫ u T'(u) exp(−T(u)) du over 0..1, for T(u) = first · u + change · u² / 2, as far as kDark.
double late_light(double first, double change) {
    const double whole = first + change / 2;
    const double seen = std::min(whole, kDark);
    const int count = 1 + static_cast<int>(std::ceil(2 * seen));
    double sum = 0.0;
    double begin = 0.0;
    for (int k = 1; k <= count; ++k) {
        // Where the depth has grown by another share; written so that neither sign of `change` cancels.
        const double depth = seen * k / count;
        const double root = std::sqrt(std::max(0.0, first * first + 2 * change * depth));
        const double end = k == count && whole <= kDark ? 1.0 : std::min(1.0, 2 * depth / (first + root));
        const double width = end - begin;
        for (int j = 0; j < kNodes; ++j) {
            const double u = begin + width * kNode[j];
            sum += width * kWeight[j] * u * (first + change * u) * std::exp(-u * (first + change * u / 2));
        }
        begin = end;
    }
    return sum;
}

struct Sum {
    double depth = 0.0;
    double light[3] = {0.0, 0.0, 0.0};
    double colour[3] = {0.0, 0.0, 0.0};  // mean, whatever the extinction
};

// Adds a piece that is `share` of the segment, with entries `near` and `far` at its ends.
void add_piece(const double* near, const double* far, double share, double step_mm, Sum& sum) {
    const double length_mm = share * step_mm;
    const double depth = length_mm * (near[3] + far[3]) / 2;
    for (int i = 0; i < 3; ++i) sum.colour[i] += share * (near[i] + far[i]) / 2;
    if (depth > 0.0 && sum.depth < kDark) {
        const double opacity = -std::expm1(-depth);
        const bool same = std::equal(near, near + 3, far);
        const double late = same ? 0.0 : late_light(length_mm * near[3], length_mm * (far[3] - near[3]));
        const double through = std::exp(-sum.depth);
        for (int i = 0; i < 3; ++i) sum.light[i] += through * (near[i] * opacity + (far[i] - near[i]) * late);
    }
    sum.depth += depth;
}

void point_light(const std::vector<Part>& parts, double value, double* light) {
    double sides[2][4];
    // The first part that reaches the value, and the last: two where it is a control point.
    const auto below = std::find_if(parts.begin(), parts.end(), [&](const Part& part) { return value <= part.high; });
    const auto above = std::find_if(parts.rbegin(), parts.rend(), [&](const Part& part) { return value >= part.low; });
    evaluate(*below, value, sides[0]);
    evaluate(*above, value, sides[1]);
    for (int i = 0; i < 4; ++i) light[i] = (sides[0][i] + sides[1][i]) / 2;
}

void segment_light(const std::vector<Part>& parts, double front, double back, double step_mm, double* light) {
    const bool rises = back > front;
    const double low = std::min(front, back), high = std::max(front, back);
    const auto count = static_cast<int64_t>(parts.size());
    Sum sum;
    for (int64_t k = 0; k < count; ++k) {
        const Part& part = parts[static_cast<std::size_t>(rises ? k : count - 1 - k)];
        const double from = std::max(low, part.low), to = std::min(high, part.high);
        if (!(from < to)) continue;
        double ends[2][4];
        evaluate(part, rises ? from : to, ends[0]);
        evaluate(part, rises ? to : from, ends[1]);
        add_piece(ends[0], ends[1], (to - from) / (high - low), step_mm, sum);
    }
    const double opacity = -std::expm1(-sum.depth);
    for (int i = 0; i < 3; ++i) light[i] = opacity > kNothing ? sum.light[i] / opacity : sum.colour[i];
    light[3] = sum.depth / step_mm;
}

}  // namespace

void preintegrate(const double* front, const double* back, int64_t n, const ControlPoints& points, double step_mm,
                  double* light, int threads) {
    const std::vector<Part> parts = linear_parts(points);
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int64_t i = 0; i < n; ++i) {
        if (front[i] == back[i]) {
            point_light(parts, front[i], light + 4 * i);
        } else {
            segment_light(parts, front[i], back[i], step_mm, light + 4 * i);
        }
    }
}

}  // namespace volprep
