// The light of a segment of a ray along which the value changes linearly.
//
// A segment is cut where its value crosses a control point. On a piece of u = 0..1 extinction and colour are linear,
// so that the optical depth T(u) is a quadratic, and the light is
//     c(0) (1 − exp(−T(1))) + (c(1) − c(0)) ∫ u T'(u) exp(−T(u)) du.
// The integral has a closed form (error function or Dawson's integral), which loses all digits where the extinction is
// nearly constant; Gauss' rule on parts of at most half an optical depth keeps them.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "volprep/rays.hpp"

namespace volprep::straight {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Light from behind 40 optical depths adds 4e-18.
inline constexpr double kDark = 40.0;
inline constexpr int kNodes = 5;
inline constexpr double kNode[kNodes] = {0.04691007703066800, 0.23076534494715845, 0.5, 0.76923465505284155,
                                         0.95308992296933200};
inline constexpr double kWeight[kNodes] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                           0.23931433524968324, 0.11846344252809454};

// The function where it is linear: from low to high, ends as the inside sees them.
struct Part {
    double low, high;
    double entry[2][4];  // colour and extinction at low and at high
};

inline void set_end(double* entry, const ControlPoints& points, int64_t i) {
    std::copy_n(points.colours + 3 * i, 3, entry);
    entry[3] = points.extinctions_per_mm[i];
}

inline std::vector<Part> linear_parts(const ControlPoints& points) {
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

inline void evaluate(const Part& part, double value, double* entry) {
    if (!std::isfinite(part.low) || !std::isfinite(part.high)) {
        std::copy_n(part.entry[0], 4, entry);
        return;
    }
    const double share = (value - part.low) / (part.high - part.low);
    for (int i = 0; i < 4; ++i) entry[i] = part.entry[0][i] + share * (part.entry[1][i] - part.entry[0][i]);
}

// ∫ u T'(u) exp(−T(u)) du over 0..1, for T(u) = first · u + change · u² / 2, as far as kDark.
inline double late_light(double first, double change) {
    const double whole = first + change / 2;
    const double seen = std::min(whole, kDark);
    // A quarter of an optical depth needs one part: the next term of Gauss' rule is below 1e-16 of the light.
    const int count = seen <= 0.25 ? 1 : 1 + static_cast<int>(std::ceil(2 * seen));
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
inline void add_piece(const double* near, const double* far, double share, double step_mm, Sum& sum) {
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

// The first part that ends at a value or above it; parts are in order, and together all of the axis.
inline std::size_t first_reaching(const std::vector<Part>& parts, double value) {
    const auto ends_below = [&](const Part& part) { return part.high < value; };
    return static_cast<std::size_t>(std::partition_point(parts.begin(), parts.end(), ends_below) - parts.begin());
}

inline void point_light(const std::vector<Part>& parts, double value, double* light) {
    double sides[2][4];
    // The first part that reaches the value, and the last: two where it is a control point.
    const std::size_t below = first_reaching(parts, value);
    std::size_t above = below;
    while (above + 1 < parts.size() && parts[above + 1].low <= value) ++above;
    evaluate(parts[below], value, sides[0]);
    evaluate(parts[above], value, sides[1]);
    for (int i = 0; i < 4; ++i) light[i] = (sides[0][i] + sides[1][i]) / 2;
}

// The joint light of the pieces of a segment from `front` to another value, `back`. `near_part` is the number of a
// part near both, where the search begins, and becomes that of the part where the segment ends: a segment begins where
// the one before it ended. Without it, functions of 256 entries took 90 % of the time of a ray.
inline Sum segment_sum(const std::vector<Part>& parts, double front, double back, double step_mm,
                       std::size_t& near_part) {
    const bool rises = back > front;
    const double low = std::min(front, back), high = std::max(front, back);
    Sum sum;
    const auto add = [&](const Part& part) {
        const double from = std::max(low, part.low), to = std::min(high, part.high);
        double ends[2][4];
        evaluate(part, rises ? from : to, ends[0]);
        evaluate(part, rises ? to : from, ends[1]);
        add_piece(ends[0], ends[1], (to - from) / (high - low), step_mm, sum);
    };
    // Parts lie side by side, the outer ones without an end. The first one holds the beginning of the segment.
    std::size_t k = near_part;
    if (rises) {
        while (k > 0 && parts[k].low > low) --k;
        while (k + 1 < parts.size() && parts[k].high <= low) ++k;
        for (add(parts[k]); parts[k].high < high; add(parts[k])) ++k;
    } else {
        while (k + 1 < parts.size() && parts[k].high < high) ++k;
        while (k > 0 && parts[k].low >= high) --k;
        for (add(parts[k]); parts[k].low > low; add(parts[k])) --k;
    }
    near_part = k;
    return sum;
}

}  // namespace volprep::straight
