// Rays in parallel, samples in order; those far outside the slab are skipped by the ray's own slope.
#include "volprep/ray_samples.hpp"

#include <algorithm>
#include <cmath>

#include "volprep/threads.hpp"

namespace volprep {
namespace {

struct Between {
    int64_t lower;
    int64_t upper;
    double weight;
};

inline Between between(double position, int64_t voxels) noexcept {
    const double inside = std::clamp(position, 0.0, static_cast<double>(voxels - 1));
    // The last voxel is the upper one of a cell, so that each position belongs to the slab of its cell.
    const int64_t lower = std::clamp<int64_t>(static_cast<int64_t>(inside), 0, std::max<int64_t>(voxels - 2, 0));
    return {lower, std::min(lower + 1, voxels - 1), inside - static_cast<double>(lower)};
}

inline double mix(double a, double b, double weight) noexcept { return a + weight * (b - a); }

struct Range {
    int64_t begin;
    int64_t end;
};

// Samples that may lie in cells [low, high) of the z axis; one too many at both ends, because of rounding.
Range near_cells(double start, double step, int64_t count, double low, double high) noexcept {
    if (std::abs(step) < 1e-12) {
        return {0, count};
    }
    const double a = (low - start) / step - 0.5;
    const double b = (high - start) / step - 0.5;
    const auto limit = static_cast<double>(count);
    return {static_cast<int64_t>(std::clamp(std::floor(std::min(a, b)) - 1, 0.0, limit)),
            static_cast<int64_t>(std::clamp(std::ceil(std::max(a, b)) + 2, 0.0, limit))};
}

}  // namespace

template <typename T>
void sample_rays(const T* src, Shape3 shape, int64_t first, int64_t depth, const Rays& rays, float* samples,
                 int threads) noexcept {
    const int64_t end = first + std::max<int64_t>(shape.z - 1, 1);
    // Beyond the outer centres a sample belongs to the outer cell.
    const double low = first == 0 ? -1e300 : static_cast<double>(first);
    const double high = end >= depth - 1 ? 1e300 : static_cast<double>(end);
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t ray = 0; ray < rays.count; ++ray) {
        const double* const origin = rays.origin_xyz + 3 * ray;
        const double* const direction = rays.direction_xyz + 3 * ray;
        const int64_t count = rays.offsets[ray + 1] - rays.offsets[ray];
        float* const out = samples + rays.offsets[ray];
        const double segment_mm = rays.length_mm[ray] / static_cast<double>(count);
        const Range range = near_cells(origin[2], direction[2] * segment_mm, count, low, high);
        for (int64_t i = range.begin; i < range.end; ++i) {
            const double t = (static_cast<double>(i) + 0.5) * segment_mm;
            const Between z = between(origin[2] + t * direction[2], depth);
            if (z.lower < first || z.lower >= end) {
                continue;
            }
            const Between y = between(origin[1] + t * direction[1], shape.y);
            const Between x = between(origin[0] + t * direction[0], shape.x);
            const auto row = [&](int64_t slice, int64_t line) {
                const T* const voxels = src + ((slice - first) * shape.y + line) * shape.x;
                return mix(static_cast<double>(voxels[x.lower]), static_cast<double>(voxels[x.upper]), x.weight);
            };
            const double near = mix(row(z.lower, y.lower), row(z.lower, y.upper), y.weight);
            const double far = mix(row(z.upper, y.lower), row(z.upper, y.upper), y.weight);
            out[i] = static_cast<float>(mix(near, far, z.weight));
        }
    }
}

template void sample_rays(const uint8_t*, Shape3, int64_t, int64_t, const Rays&, float*, int) noexcept;
template void sample_rays(const uint16_t*, Shape3, int64_t, int64_t, const Rays&, float*, int) noexcept;

}  // namespace volprep
