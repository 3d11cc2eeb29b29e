// The light of rays from samples along them and a lookup table, and how it changes with the table: what fitting a table
// to pictures needs.
#pragma once

#include <cstdint>

namespace volprep {

// A lookup table, linear between its entries: value 0 is the first, 1 the last.
struct LightTable {
    int64_t entries;     // at least 2
    const double* rgba;  // [entries][4] linear colour, and extinction per millimetre
};

// Samples in the middles of equal segments of rays, as sample_rays writes them, times `scale` the values of the table.
struct RaySamples {
    int64_t count;
    const int64_t* offsets;   // [count + 1]
    const double* length_mm;  // [count]
    const float* samples;
    double scale;
};

// light[ray][4] = premultiplied colour and opacity: segments of opacity 1 - exp(-extinction · length), front to back.
void ray_light(const RaySamples& rays, const LightTable& table, double* light, int threads) noexcept;

// Gauss-Newton's equations for a change of the table that is linear between `knots` values at equal distances, from 0
// to 1: of red, green and blue by a change of the colour, and of the extinction as a change of its square root. With
// `light` as ray_light gives it for this table, r = light - target and J its derivative by the 4 · knots unknowns (all
// of red, of green, of blue, of the root): matrix [4 · knots][4 · knots] = JᵀJ / count, gradient [4 · knots] = Jᵀr /
// count. The sums do not depend on the number of threads.
void light_equations(const RaySamples& rays, const LightTable& table, const double* light, const double* target,
                     int64_t knots, double* matrix, double* gradient, int threads) noexcept;

// Solves matrix · x = rhs in place (rhs becomes x) for a symmetric positive definite matrix [n][n], by Cholesky's
// decomposition, which overwrites the lower triangle. Gives false where the matrix is not positive definite.
bool solve_positive(double* matrix, double* rhs, int64_t n) noexcept;

}  // namespace volprep
