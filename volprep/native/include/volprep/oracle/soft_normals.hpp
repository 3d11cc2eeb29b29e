// How far a place is a surface: normals that are short count less, so that light changes evenly where a gradient
// vanishes.
#pragma once

#include <cmath>

namespace volprep::oracle {

// Length of the normal of a place that counts half as a surface. Slopes that a shader takes are scaled to it.
inline constexpr double kSoftLength = 0.01;
inline constexpr double kSoftSquare = kSoftLength * kSoftLength;

inline double dot(const double a[3], const double b[3]) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The part of a place that is a surface: 0 without a normal, nearly 1 with a long one.
inline double surface_share(const double n[3]) noexcept {
    const double square = dot(n, n);
    return square / (square + kSoftSquare);
}

// The light from the viewer: the cosine of ray and normal, 1 without a normal.
inline double headlight(const double n[3], const double direction[3]) noexcept {
    const double along = dot(n, direction);
    return std::sqrt((along * along + kSoftSquare) / (dot(n, n) + kSoftSquare));
}

}  // namespace volprep::oracle
