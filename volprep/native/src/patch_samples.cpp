// Some samples of a ray at a time: their positions become vectors, and their voxels are gathered. Some rays at a
// time: neighbouring results are written together.
#include <algorithm>
#include <cmath>

#include "volprep/clones.hpp"
#include "volprep/rays.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t kSamples = 64;
constexpr int64_t kRays = 8;

// Samples along one axis: the voxel below each, and how far it is to the next one.
struct Places {
    int32_t lower[kSamples];
    double share[kSamples];
};

VOLPREP_CLONES void find_places(double start, double velocity, double step_mm, int64_t first, int64_t voxels,
                                Places& places) noexcept {
    const auto shape = static_cast<double>(voxels);
    const double period = 2.0 * shape;
    const double last = shape - 1.0;
    const auto last_lower = static_cast<int32_t>(std::max<int64_t>(voxels - 2, 0));
    for (int64_t i = 0; i < kSamples; ++i) {
        const double at_mm = (static_cast<double>(static_cast<int32_t>(first + i)) + 0.5) * step_mm;
        const double place = start + velocity * at_mm;
        const double inside = shape - std::fabs(shape - (place - period * std::floor(place / period)));
        const double centred = std::min(std::max(inside - 0.5, 0.0), last);
        const int32_t lower = std::min(static_cast<int32_t>(centred), last_lower);
        places.lower[i] = lower;
        places.share[i] = centred - static_cast<double>(lower);
    }
}

inline double mix(double a, double b, double share) noexcept { return a + share * (b - a); }

void sample_ray(const double* patch, Shape3 shape, const Places places_zyx[3], int64_t count, double* out) noexcept {
    const Places &z = places_zyx[0], &y = places_zyx[1], &x = places_zyx[2];
    // Along an axis of one voxel the next one is itself.
    const int64_t next_z = shape.z > 1 ? shape.slice() : 0;
    const int64_t next_y = shape.y > 1 ? shape.x : 0;
    const int64_t next_x = shape.x > 1 ? 1 : 0;
    for (int64_t i = 0; i < count; ++i) {
        const double* const voxel = patch + shape.slice() * z.lower[i] + shape.x * y.lower[i] + x.lower[i];
        const auto row = [&](int64_t beyond) { return mix(voxel[beyond], voxel[beyond + next_x], x.share[i]); };
        const auto plane = [&](int64_t beyond) { return mix(row(beyond), row(beyond + next_y), y.share[i]); };
        out[i] = mix(plane(0), plane(next_z), z.share[i]);
    }
}

}  // namespace

void sample_patches(const Patches& patches, const PatchRays& rays, double* values, int threads) noexcept {
    const int64_t shape_zyx[3] = {patches.shape.z, patches.shape.y, patches.shape.x};
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t begin = 0; begin < rays.count; begin += kRays) {
        const int64_t beside = std::min(kRays, rays.count - begin);
        Places places[3];
        double found[kRays][kSamples];
        for (int64_t first = 0; first < rays.samples; first += kSamples) {
            const int64_t count = std::min(kSamples, rays.samples - first);
            for (int64_t ray = begin; ray < begin + beside; ++ray) {
                for (int axis = 0; axis < 3; ++axis) {
                    find_places(rays.start_zyx[3 * ray + axis], rays.velocity_zyx[3 * ray + axis], rays.step_mm, first,
                                shape_zyx[axis], places[axis]);
                }
                const int64_t voxels = patches.shape.z * patches.shape.slice();
                sample_ray(patches.values + ray % patches.count * voxels, patches.shape, places, count,
                           found[ray - begin]);
            }
            for (int64_t i = 0; i < count; ++i) {
                for (int64_t k = 0; k < beside; ++k) values[(first + i) * rays.count + begin + k] = found[k][i];
            }
        }
    }
}

}  // namespace volprep
