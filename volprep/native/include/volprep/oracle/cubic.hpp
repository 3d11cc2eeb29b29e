// A cubic polynomial on [-1, 1]: the field along the part of a ray that lies in one cell. The centred interval makes
// the bounds short: |y| <= R turns every bound on an ellipse around the interval into a sum of |coefficient| R^k.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

namespace volprep::oracle {

struct Cubic {
    double c0, c1, c2, c3;

    double at(double y) const noexcept { return c0 + y * (c1 + y * (c2 + y * c3)); }
    double slope(double y) const noexcept { return c1 + y * (2.0 * c2 + y * (3.0 * c3)); }

    // Largest |slope| on the disc |y| <= radius, from the triangle inequality.
    double slope_bound(double radius) const noexcept {
        return std::fabs(c1) + radius * (2.0 * std::fabs(c2) + radius * (3.0 * std::fabs(c3)));
    }

    // The same curve over [from, to], stretched to [-1, 1].
    Cubic between(double from, double to) const noexcept {
        const double middle = 0.5 * (from + to);
        const double half = 0.5 * (to - from);
        return {at(middle), slope(middle) * half, (c2 + 3.0 * c3 * middle) * half * half, c3 * half * half * half};
    }
};

// Writes the places in (-1, 1) where the slope changes sign, in order, and returns how many there are (0, 1 or 2).
inline int extrema(const Cubic& cubic, double out[2]) noexcept {
    // Most pieces are short: their slope keeps its sign by far.
    if (std::fabs(cubic.c1) > 2.0 * std::fabs(cubic.c2) + 3.0 * std::fabs(cubic.c3)) return 0;
    const double discriminant = cubic.c2 * cubic.c2 - 3.0 * cubic.c1 * cubic.c3;
    if (!(discriminant > 0.0)) return 0;
    // The form without cancellation; a division by zero gives inf or NaN, which the comparisons below leave out.
    const double sum = -(cubic.c2 + std::copysign(std::sqrt(discriminant), cubic.c2));
    double first = sum / (3.0 * cubic.c3);
    double second = cubic.c1 / sum;
    if (first > second) std::swap(first, second);
    int count = 0;
    if (first > -1.0 && first < 1.0) out[count++] = first;
    if (second > -1.0 && second < 1.0) out[count++] = second;
    return count;
}

// Where the cubic takes the value `level` on [from, to], where it is monotone and its ends lie on both sides of it.
// Newton's method kept inside a bracket that shrinks with every step; where it would leave the bracket, a bisection.
inline double crossing(const Cubic& cubic, double from, double to, double level) noexcept {
    constexpr double kClose = 4.5e-16;  // two units in the last place of 1: positions are not finer than that
    const double at_from = cubic.at(from) - level;
    const double at_to = cubic.at(to) - level;
    double below = at_from < at_to ? from : to;                           // cubic < level here
    double above = at_from < at_to ? to : from;                           // cubic > level here
    const double bend = std::fabs(cubic.c2) + 3.0 * std::fabs(cubic.c3);  // half of the largest second derivative
    double y = from - at_from * (to - from) / (at_to - at_from);
    for (int i = 0; i < 100; ++i) {
        if (!(y >= from && y <= to)) y = 0.5 * (below + above);
        const double value = cubic.at(y) - level;
        if (value == 0.0) return y;
        (value < 0.0 ? below : above) = y;
        const double slope = cubic.slope(y);
        const double step = value / slope;
        double next = y - step;
        if (!(next > std::min(below, above) && next < std::max(below, above))) {
            next = 0.5 * (below + above);
        } else if (bend * step * step <= kClose * std::fabs(slope)) {
            // The remainder of the cubic's Taylor series at `next`, over the slope there or a little less.
            return next;
        }
        if (std::fabs(next - y) <= kClose) return next;
        y = next;
    }
    return y;
}

}  // namespace volprep::oracle
