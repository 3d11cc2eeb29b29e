// Rays in parallel, samples in order; those far outside the slab are skipped by the ray's own slope. The positions
// of several samples are computed as vectors, their voxels are gathered, and mixed as vectors. Rays run in all
// directions, so that most voxels of a large volume come from memory: those of the next samples are asked for before
// these are mixed.
#include <algorithm>
#include <cmath>
#include <utility>

#include "volprep/clones.hpp"
#include "volprep/rays.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kSamples = 32;
// Short rays have fewer; so many are one step of vectors.
constexpr int64_t kTogether = 4;

// Some samples of a ray along one axis: the voxel below each, and how far it is to the next one.
struct Places {
    int32_t lower[kSamples];
    double weight[kSamples];
};

VOLPREP_CLONES void find_places(double origin, double direction, double segment_mm, int64_t begin, int64_t count,
                                int64_t voxels, Places& places) noexcept {
    const auto last = static_cast<double>(voxels - 1);
    // The last voxel is the upper one of a cell, so that each position belongs to the slab of its cell.
    const auto last_lower = static_cast<int32_t>(std::max<int64_t>(voxels - 2, 0));
    for (int64_t i = 0; i < count; ++i) {
        const double t = (static_cast<double>(static_cast<int32_t>(begin + i)) + 0.5) * segment_mm;
        const double inside = std::min(std::max(origin + t * direction, 0.0), last);
        const int32_t lower = std::min(static_cast<int32_t>(inside), last_lower);
        places.lower[i] = lower;
        places.weight[i] = inside - static_cast<double>(lower);
    }
}

inline double mix(double a, double b, double weight) noexcept { return a + weight * (b - a); }

// The voxels at the corners of the cells of some samples; x changes first, then y, then z.
template <typename T>
using Corners = T[8][kSamples];

template <typename T>
VOLPREP_CLONES void mix_corners(const Corners<T>& corners, const Places& z, const Places& y, const Places& x,
                                int64_t count, float* __restrict out) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        const auto row = [&](int first) {
            return mix(static_cast<double>(corners[first][i]), static_cast<double>(corners[first + 1][i]), x.weight[i]);
        };
        const double near = mix(row(0), row(2), y.weight[i]);
        const double far = mix(row(4), row(6), y.weight[i]);
        out[i] = static_cast<float>(mix(near, far, z.weight[i]));
    }
}

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

// A slab of slices, first to end, each with a next one; distances from a voxel to the next along each axis.
template <typename T>
struct Slab {
    const T* voxels;
    int64_t first;
    int64_t end;
    int64_t depth;
    int64_t rows;
    int64_t columns;
    int64_t next_z;
    int64_t next_y;
    int64_t next_x;

    bool holds(int32_t z) const noexcept { return z >= first && z < end; }
};

// Where some samples of a ray lie.
template <typename T>
struct Batch {
    Places z, y, x;
    const T* voxels[kSamples];
    int64_t count = 0;

    void find(const Slab<T>& slab, const double* origin, const double* direction, double segment_mm,
              const Range& range) noexcept {
        const int64_t begin = range.begin;
        count = std::min(kSamples, (range.end - begin + kTogether - 1) / kTogether * kTogether);
        find_places(origin[2], direction[2], segment_mm, begin, count, slab.depth, z);
        find_places(origin[1], direction[1], segment_mm, begin, count, slab.rows, y);
        find_places(origin[0], direction[0], segment_mm, begin, count, slab.columns, x);
        for (int64_t i = 0; i < count; ++i) {
            // Samples outside read the slab, too, and are not written.
            const int64_t slice = std::clamp<int64_t>(z.lower[i], slab.first, slab.end - 1) - slab.first;
            voxels[i] = slab.voxels + (slice * slab.rows + y.lower[i]) * slab.columns + x.lower[i];
            for (const int64_t beyond : {int64_t{0}, slab.next_y, slab.next_z, slab.next_z + slab.next_y}) {
                __builtin_prefetch(voxels[i] + beyond);
            }
        }
    }

    void sample(const Slab<T>& slab, float* values) const noexcept {
        Corners<T> corners;
        const int64_t beyond[4] = {0, slab.next_y, slab.next_z, slab.next_z + slab.next_y};
        for (int64_t i = 0; i < count; ++i) {
            for (int row = 0; row < 4; ++row) {
                corners[2 * row][i] = voxels[i][beyond[row]];
                corners[2 * row + 1][i] = voxels[i][beyond[row] + slab.next_x];
            }
        }
        mix_corners<T>(corners, z, y, x, count, values);
    }
};

}  // namespace

template <typename T>
void sample_rays(const T* src, Shape3 shape, int64_t first, int64_t depth, const Rays& rays, float* samples,
                 int threads) noexcept {
    const int64_t end = first + std::max<int64_t>(shape.z - 1, 1);
    // Beyond the outer centres a sample belongs to the outer cell.
    const double low = first == 0 ? -1e300 : static_cast<double>(first);
    const double high = end >= depth - 1 ? 1e300 : static_cast<double>(end);
    // Along an axis of one voxel the next one is itself.
    const Slab<T> slab{src,
                       first,
                       end,
                       depth,
                       shape.y,
                       shape.x,
                       depth > 1 ? shape.slice() : 0,
                       shape.y > 1 ? shape.x : 0,
                       shape.x > 1 ? 1 : 0};
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t ray = 0; ray < rays.count; ++ray) {
        const double* const origin = rays.origin_xyz + 3 * ray;
        const double* const direction = rays.direction_xyz + 3 * ray;
        const int64_t count = rays.offsets[ray + 1] - rays.offsets[ray];
        float* const out = samples + rays.offsets[ray];
        const double segment_mm = rays.length_mm[ray] / static_cast<double>(count);
        const Range range = near_cells(origin[2], direction[2] * segment_mm, count, low, high);
        Batch<T> batches[2];
        Batch<T>* now = batches;
        Batch<T>* next = batches + 1;
        if (range.begin < range.end) {
            now->find(slab, origin, direction, segment_mm, range);
        }
        for (int64_t begin = range.begin; begin < range.end; begin += kSamples) {
            if (begin + kSamples < range.end) {
                next->find(slab, origin, direction, segment_mm, {begin + kSamples, range.end});
            }
            float values[kSamples];
            now->sample(slab, values);
            for (int64_t i = 0; i < std::min(kSamples, range.end - begin); ++i) {
                if (slab.holds(now->z.lower[i])) {
                    out[begin + i] = values[i];
                }
            }
            std::swap(now, next);
        }
    }
}

template void sample_rays(const uint8_t*, Shape3, int64_t, int64_t, const Rays&, float*, int) noexcept;
template void sample_rays(const uint16_t*, Shape3, int64_t, int64_t, const Rays&, float*, int) noexcept;

}  // namespace volprep
