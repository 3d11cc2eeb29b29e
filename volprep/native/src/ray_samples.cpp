// Rays in parallel, samples in order; those far outside the slab are skipped by the ray's own slope. The positions
// of several samples are computed as vectors, and their voxels are gathered.
#include "volprep/ray_samples.hpp"

#include <algorithm>
#include <cmath>

#include "volprep/clones.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kSamples = 32;

// Some samples of a ray along one axis: the voxel below each, and how far it is to the next one.
struct Places {
    int32_t lower[kSamples];
    double weight[kSamples];
};

VOLPREP_CLONES void find_places(double origin, double direction, double segment_mm, int64_t begin, int64_t voxels,
                                Places& places) noexcept {
    const auto last = static_cast<double>(voxels - 1);
    // The last voxel is the upper one of a cell, so that each position belongs to the slab of its cell.
    const auto last_lower = static_cast<int32_t>(std::max<int64_t>(voxels - 2, 0));
    for (int64_t i = 0; i < kSamples; ++i) {
        const double t = (static_cast<double>(static_cast<int32_t>(begin + i)) + 0.5) * segment_mm;
        const double inside = std::min(std::max(origin + t * direction, 0.0), last);
        const int32_t lower = std::min(static_cast<int32_t>(inside), last_lower);
        places.lower[i] = lower;
        places.weight[i] = inside - static_cast<double>(lower);
    }
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
    // Along an axis of one voxel the next one is itself.
    const int64_t next_z = depth > 1 ? shape.slice() : 0;
    const int64_t next_y = shape.y > 1 ? shape.x : 0;
    const int64_t next_x = shape.x > 1 ? 1 : 0;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t ray = 0; ray < rays.count; ++ray) {
        const double* const origin = rays.origin_xyz + 3 * ray;
        const double* const direction = rays.direction_xyz + 3 * ray;
        const int64_t count = rays.offsets[ray + 1] - rays.offsets[ray];
        float* const out = samples + rays.offsets[ray];
        const double segment_mm = rays.length_mm[ray] / static_cast<double>(count);
        const Range range = near_cells(origin[2], direction[2] * segment_mm, count, low, high);
        Places z, y, x;
        for (int64_t begin = range.begin; begin < range.end; begin += kSamples) {
            find_places(origin[2], direction[2], segment_mm, begin, depth, z);
            find_places(origin[1], direction[1], segment_mm, begin, shape.y, y);
            find_places(origin[0], direction[0], segment_mm, begin, shape.x, x);
            for (int64_t i = 0; i < std::min(kSamples, range.end - begin); ++i) {
                if (z.lower[i] < first || z.lower[i] >= end) {
                    continue;
                }
                const T* const voxel = src + ((z.lower[i] - first) * shape.y + y.lower[i]) * shape.x + x.lower[i];
                const auto row = [&](int64_t beyond) {
                    return mix(static_cast<double>(voxel[beyond]), static_cast<double>(voxel[beyond + next_x]),
                               x.weight[i]);
                };
                const double near = mix(row(0), row(next_y), y.weight[i]);
                const double far = mix(row(next_z), row(next_z + next_y), y.weight[i]);
                out[begin + i] = static_cast<float>(mix(near, far, z.weight[i]));
            }
        }
    }
}

template void sample_rays(const uint8_t*, Shape3, int64_t, int64_t, const Rays&, float*, int) noexcept;
template void sample_rays(const uint16_t*, Shape3, int64_t, int64_t, const Rays&, float*, int) noexcept;

}  // namespace volprep
