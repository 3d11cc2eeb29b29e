#include <cmath>
#include <vector>

#include "volprep/rays.hpp"
#include "volprep/straight_segment.hpp"

namespace volprep {
namespace {

// Light below this has lost digits to underflow.
constexpr double kNothing = 1e-200;

}  // namespace

void preintegrate(const double* front, const double* back, int64_t n, const ControlPoints& points, double step_mm,
                  double* light, int threads) {
    const std::vector<straight::Part> parts = straight::linear_parts(points);
#pragma omp parallel num_threads(threads)
    {
        std::size_t near_part = 0;
#pragma omp for schedule(static)
        for (int64_t i = 0; i < n; ++i) {
            double* const entry = light + 4 * i;
            if (front[i] == back[i]) {
                straight::point_light(parts, front[i], entry);
                continue;
            }
            const straight::Sum sum = straight::segment_sum(parts, front[i], back[i], step_mm, near_part);
            const double opacity = -std::expm1(-sum.depth);
            for (int c = 0; c < 3; ++c) entry[c] = opacity > kNothing ? sum.light[c] / opacity : sum.colour[c];
            entry[3] = sum.depth / step_mm;
        }
    }
}

}  // namespace volprep
