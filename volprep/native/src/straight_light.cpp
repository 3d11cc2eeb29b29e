// Some rays at a time, which lie beside each other in memory.
#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/rays.hpp"
#include "volprep/straight_segment.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kRays = 8;

struct Beam {
    double light[3] = {0.0, 0.0, 0.0};
    double transmittance = 1.0;
    std::size_t near_part = 0;

    void pass(const double* added, double scale, double opacity) noexcept {
        for (int c = 0; c < 3; ++c) light[c] += transmittance * (scale * added[c]);
        transmittance *= 1.0 - opacity;
    }
    void pass_segment(const std::vector<straight::Part>& parts, double front, double back, double piece_mm) {
        if (front == back) {
            double entry[4];
            straight::point_light(parts, front, entry);
            const double opacity = -std::expm1(-entry[3] * piece_mm);
            pass(entry, opacity, opacity);
            return;
        }
        const straight::Sum sum = straight::segment_sum(parts, front, back, piece_mm, near_part);
        if (sum.depth > 0.0) pass(sum.light, 1.0, -std::expm1(-sum.depth));
    }
};

// Where a piece ends, in samples.
struct End {
    int64_t lower;
    int64_t upper;
    double share;
};

End end_at(double place, int64_t samples) noexcept {
    const double inside = std::clamp(place - 0.5, 0.0, static_cast<double>(samples - 1));
    const int64_t lower = std::min(static_cast<int64_t>(inside), std::max<int64_t>(samples - 2, 0));
    return {lower, std::min(lower + 1, samples - 1), inside - static_cast<double>(lower)};
}

}  // namespace

void straight_light(const SampledRays& rays, const ControlPoints& points, int64_t pieces, double piece_mm,
                    double* light, int threads) {
    const std::vector<straight::Part> parts = straight::linear_parts(points);
    const double piece = static_cast<double>(rays.samples) / static_cast<double>(pieces);
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t begin = 0; begin < rays.count; begin += kRays) {
        const int64_t beside = std::min(kRays, rays.count - begin);
        Beam beams[kRays];
        double front[kRays];
        std::copy_n(rays.values + begin, beside, front);
        for (int64_t k = 1; k <= pieces; ++k) {
            const End end = end_at(static_cast<double>(k) * piece, rays.samples);
            const double* const lower = rays.values + end.lower * rays.count + begin;
            const double* const upper = rays.values + end.upper * rays.count + begin;
            for (int64_t i = 0; i < beside; ++i) {
                const double back = lower[i] + end.share * (upper[i] - lower[i]);
                beams[i].pass_segment(parts, front[i], back, piece_mm);
                front[i] = back;
            }
        }
        for (int64_t i = 0; i < beside; ++i) {
            std::copy_n(beams[i].light, 3, light + 4 * (begin + i));
            light[4 * (begin + i) + 3] = 1.0 - beams[i].transmittance;
        }
    }
}

}  // namespace volprep
