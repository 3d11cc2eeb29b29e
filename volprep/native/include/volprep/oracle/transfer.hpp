// The transfer function as the oracle uses it: extinction per millimetre and colour, both linear in the physical value
// between control points, constant outside. Two control points at one value make a jump.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace volprep::oracle {

// Extinction above this, infinite too, counts as this: within a micrometre it lets through exp(-1e6) of the light.
inline constexpr double kOpaquePerMm = 1e9;

// extinction and colour are `x + x_slope * (value - origin)`.
struct Segment {
    double origin;
    double extinction;
    double extinction_slope;
    double colour[3];
    double colour_slope[3];
    double colour_steepness;  // the largest |colour_slope|
    bool empty;               // no extinction anywhere on it
};

// One value where the rule changes. Below it segment k holds, above it (and exactly at it) segment k + 1.
struct Knot {
    double value;
    bool jump;      // extinction or colour are not continuous here
    Segment below;  // what the values just below have: constant
    Segment above;
};

// Values from `low` to `high`, both included, have no extinction.
struct EmptyRange {
    double low;
    double high;
};

struct Transfer {
    std::vector<Knot> knots;        // strictly ascending values
    std::vector<Segment> segments;  // knots + 1: below the first, between them, above the last
    std::vector<EmptyRange> empty_ranges;
    double colour_max;  // largest colour component, at least 1 (alpha counts as a colour of 1)

    bool empty_between(double low, double high) const noexcept {
        for (const EmptyRange& range : empty_ranges) {
            if (low >= range.low && high <= range.high) return true;
        }
        return false;
    }

    // At a jump the value itself belongs to the side above.
    double extinction_at(double value) const noexcept {
        const auto above = [](double at, const Knot& knot) { return at < knot.value; };
        const auto knot = std::upper_bound(knots.begin(), knots.end(), value, above);
        const Segment& segment = segments[static_cast<std::size_t>(knot - knots.begin())];
        return segment.extinction + segment.extinction_slope * (value - segment.origin);
    }
};

// `values` ascend (equal ones allowed), `colours` are [count, 3] and not negative, `extinctions_per_mm` not negative.
// Control points closer together than 1e-12 of the largest |value| count as one place, that is as a jump.
Transfer prepare_transfer(int64_t count, const double* values, const double* colours, const double* extinctions_per_mm);

}  // namespace volprep::oracle
