#include <algorithm>
#include <cmath>
#include <limits>

#include "volprep/oracle/transfer.hpp"

namespace volprep::oracle {

namespace {

struct Point {
    double value;
    double extinction;
    const double* colour;
};

Segment constant_segment(const Point& point) {
    Segment segment{};
    segment.origin = point.value;
    segment.extinction = point.extinction;
    std::copy_n(point.colour, 3, segment.colour);
    segment.empty = point.extinction == 0.0;
    return segment;
}

Segment linear_segment(const Point& from, const Point& to) {
    Segment segment = constant_segment(from);
    const double width = to.value - from.value;
    segment.extinction_slope = (to.extinction - from.extinction) / width;
    for (int channel = 0; channel < 3; ++channel) {
        const double slope = (to.colour[channel] - from.colour[channel]) / width;
        segment.colour_slope[channel] = slope;
        segment.colour_steepness = std::max(segment.colour_steepness, std::fabs(slope));
    }
    segment.empty = from.extinction == 0.0 && to.extinction == 0.0;
    return segment;
}

// Where the light cannot tell a change of colour (no extinction on either side), there is no jump.
bool is_jump(const Point& below, const Point& above) {
    const bool same = below.extinction == above.extinction && std::equal(below.colour, below.colour + 3, above.colour);
    return !same && (below.extinction > 0.0 || above.extinction > 0.0);
}

std::vector<EmptyRange> find_empty_ranges(const Transfer& transfer) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const std::size_t count = transfer.segments.size();
    std::vector<EmptyRange> ranges;
    for (std::size_t i = 0; i < count; ++i) {
        if (!transfer.segments[i].empty) continue;
        const double low = i == 0 ? -kInfinity : transfer.knots[i - 1].value;
        while (i + 1 < count && transfer.segments[i + 1].empty) ++i;
        double high = kInfinity;
        if (i + 1 < count) {
            const Knot& end = transfer.knots[i];
            // The value exactly at a jump belongs to the side above, which is not empty here.
            high = !end.above.empty ? std::nextafter(end.value, -kInfinity) : end.value;
        }
        ranges.push_back({low, high});
    }
    return ranges;
}

}  // namespace

Transfer prepare_transfer(int64_t count, const double* values, const double* colours,
                          const double* extinctions_per_mm) {
    static constexpr double kBlack[3] = {0.0, 0.0, 0.0};
    Transfer transfer{};
    transfer.colour_max = 1.0;
    double scale = 0.0;
    for (int64_t i = 0; i < count; ++i) scale = std::max(scale, std::fabs(values[i]));
    const double close = 1e-12 * scale;
    Point last{0.0, 0.0, kBlack};
    for (int64_t i = 0; i < count;) {
        const auto point = [&](int64_t k) {
            return Point{values[k], std::min(extinctions_per_mm[k], kOpaquePerMm), colours + 3 * k};
        };
        const Point below = point(i);
        transfer.segments.push_back(i == 0 ? constant_segment(below) : linear_segment(last, below));
        int64_t end = i + 1;
        while (end < count && values[end] - below.value <= close) ++end;
        Point above = point(end - 1);
        above.value = below.value;
        transfer.knots.push_back(
            {below.value, is_jump(below, above), constant_segment(below), constant_segment(above)});
        last = above;
        i = end;
    }
    transfer.segments.push_back(constant_segment(last));
    for (int64_t i = 0; i < 3 * count; ++i) transfer.colour_max = std::max(transfer.colour_max, colours[i]);
    transfer.empty_ranges = find_empty_ranges(transfer);
    return transfer;
}

}  // namespace volprep::oracle
