// Extinction along a piece of a ray, a cubic polynomial, and its derived quantities.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "volprep/oracle/beam.hpp"

namespace volprep::oracle {

inline constexpr double kStiff = 2.0;   // smallest optical depth of pieces that are cut by depth
inline constexpr double kWidest = 3.0;  // of the optical depth on the ellipse where the exponential is bounded
inline constexpr int kDeepestCut = 60;  // halvings; then the bound is taken as it is

// tau[0] + tau[1] y + ..., y in [-1, 1].
struct Extinction {
    std::array<double, 4> tau;
    double half_length;

    explicit Extinction(const Piece& piece) noexcept : half_length(0.5 * piece.length_mm) {
        const Segment& segment = *piece.segment;
        const double offset = (piece.base - segment.origin) + piece.value.c0;
        tau = {segment.extinction + segment.extinction_slope * offset, segment.extinction_slope * piece.value.c1,
               segment.extinction_slope * piece.value.c2, segment.extinction_slope * piece.value.c3};
    }
    double at(double y) const noexcept { return tau[0] + y * (tau[1] + y * (tau[2] + y * tau[3])); }
    double antiderivative(double y) const noexcept {
        return half_length * y * (tau[0] + y * (tau[1] / 2.0 + y * (tau[2] / 3.0 + y * tau[3] / 4.0)));
    }
    double depth() const noexcept { return std::max(0.0, 2.0 * half_length * (tau[0] + tau[2] / 3.0)); }
    // The optical depth from the start to the middle.
    double depth_at_0() const noexcept { return -antiderivative(-1.0); }
    // The largest |extinction| on the disc |y| <= radius.
    double largest(double radius) const noexcept {
        return std::fabs(tau[0]) +
               radius * (std::fabs(tau[1]) + radius * (std::fabs(tau[2]) + radius * std::fabs(tau[3])));
    }
    // W: how far the optical depth on the disc |y| <= radius may be from that at y = 0.
    double spread(double radius) const noexcept {
        return half_length * radius *
               (std::fabs(tau[0]) + radius * (std::fabs(tau[1]) / 2.0 +
                                              radius * (std::fabs(tau[2]) / 3.0 + radius * std::fabs(tau[3]) / 4.0)));
    }
};

// A place where the optical depth from the start is between 1/2 and 3/2, for a piece that has more than kStiff.
// Optical has an antiderivative of the extinction along the piece: `Extinction`, or that of a mixture.
template <typename Optical>
double place_of_depth_one(const Optical& extinction) noexcept {
    const double start = extinction.antiderivative(-1.0);
    double low = -1.0;
    double high = 1.0;
    for (;;) {
        const double y = 0.5 * (low + high);
        const double depth = extinction.antiderivative(y) - start;
        if (!(y > low && y < high) || (depth >= 0.5 && depth <= 1.5)) return y;
        (depth < 1.0 ? low : high) = y;
    }
}

}  // namespace volprep::oracle
