// The light from the viewer along a piece of a ray, L in oracle_lit.cpp, and bounds of it in the complex plane.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "volprep/oracle/beam.hpp"
#include "volprep/oracle/soft_normals.hpp"

namespace volprep::oracle {

// L goes up and down at most eleven times on a piece: the numerator of the slope of its square has degree 10.
inline constexpr double kTurns = 11.0;

// Normals along a piece: n . d, a cubic, |N|^2, and how N changes along N(0) and across.
struct Shade {
    Cubic along{0.0, 0.0, 0.0, 0.0};
    std::array<double, 7> square{};
    double middle = 0.0;             // |N(0)|
    std::array<double, 3> longer{};  // |s_k|, k = 1 to 3
    std::array<double, 3> aside{};   // |w_k|

    Shade(const CellNormals& normals, double from, double to) noexcept {
        double c[4][4] = {{0.0, 0.0, 0.0, kSoftLength}};
        const bool whole = from == -1.0 && to == 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const Cubic& in_cell = normals.axes[axis];
            const Cubic n = whole ? in_cell : in_cell.between(from, to);
            const double d = normals.direction[axis];
            along = {along.c0 + d * n.c0, along.c1 + d * n.c1, along.c2 + d * n.c2, along.c3 + d * n.c3};
            c[0][axis] = n.c0;
            c[1][axis] = n.c1;
            c[2][axis] = n.c2;
            c[3][axis] = n.c3;
        }
        for (std::size_t i = 0; i < 4; ++i) {
            square[2 * i] += dot(c[i], c[i]);
            for (std::size_t j = i + 1; j < 4; ++j) square[i + j] += 2.0 * dot(c[i], c[j]);
        }
        middle = std::sqrt(square[0]);
        for (std::size_t k = 0; k < 3; ++k) {
            const double rise = dot(c[k + 1], c[0]) / middle;
            double across[4];
            for (int axis = 0; axis < 4; ++axis) across[axis] = c[k + 1][axis] - rise * c[0][axis] / middle;
            longer[k] = std::fabs(rise);
            aside[k] = std::sqrt(dot(across, across));
        }
    }
    // How far |N|^2 may be from that at 0, on the disc |y| <= radius.
    double spread(double radius) const noexcept {
        double sum = 0.0;
        for (std::size_t k = 6; k > 0; --k) sum = radius * (std::fabs(square[k]) + sum);
        return sum;
    }
    // The least |N . N(0)| / |N(0)| on the disc, or a little less.
    double ahead(double radius) const noexcept { return middle - sum_of(longer, radius); }
    // The least |N . N| on the disc, or a little less; not positive where it may be 0.
    double least_square(double radius) const noexcept {
        const double near = ahead(radius);
        const double apart = sum_of(aside, radius);
        const double by_direction = near > 0.0 ? near * near - apart * apart : 0.0;
        return std::max(square[0] - spread(radius), by_direction);
    }
    double at(double y) const noexcept {
        double sum = 0.0;
        for (std::size_t k = 7; k > 0; --k) sum = y * sum + square[k - 1];
        const double cosine = along.at(y);
        return std::sqrt((cosine * cosine + kSoftSquare) / std::max(sum, kSoftSquare));
    }
    // The largest |L|^2 on the disc |y| <= radius; infinite where it may not be analytic.
    double square_bound(double radius) const noexcept {
        const double least = least_square(radius);
        const double turned =
            radius * (std::fabs(along.c1) + radius * (std::fabs(along.c2) + radius * std::fabs(along.c3)));
        if (!(least > 0.0) || !(turned * turned < along.c0 * along.c0 + kSoftSquare)) {
            return std::numeric_limits<double>::infinity();
        }
        const double largest = std::fabs(along.c0) + turned;
        return (largest * largest + kSoftSquare) / least;
    }
    // |L|^2 at 0, which is no larger.
    double square_at_0() const noexcept { return (along.c0 * along.c0 + kSoftSquare) / square[0]; }

  private:
    static double dot(const double a[4], const double b[4]) noexcept {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    }
    static double sum_of(const std::array<double, 3>& terms, double radius) noexcept {
        return radius * (terms[0] + radius * (terms[1] + radius * terms[2]));
    }
};

}  // namespace volprep::oracle
