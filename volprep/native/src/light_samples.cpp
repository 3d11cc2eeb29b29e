// Each sample has its own stream of random numbers, so that threads do not show in the result.
#include <algorithm>
#include <cmath>

#include "volprep/light.hpp"
#include "volprep/light/make_medium.hpp"
#include "volprep/oracle/walk.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

constexpr int kTries = 64;
constexpr int kBounceTries = 4;  // in a thin veil light is hardly ever stopped twice

// A ray from outside the box, uniform among all that meet the sphere around the box.
oracle::Ray random_ray(const OracleVolume& volume, light::Stream& stream) noexcept {
    double radius = 0.0;
    for (const double extent : volume.extent_mm_xyz) radius += 0.25 * extent * extent;
    radius = std::sqrt(radius);
    oracle::Ray ray{};
    stream.direction(ray.direction);
    double across[3];
    double square = 2.0;
    while (square > 1.0) {
        const double a = 2.0 * stream.uniform() - 1.0;
        const double b = 2.0 * stream.uniform() - 1.0;
        square = a * a + b * b;
        const int least = std::fabs(ray.direction[0]) < 0.6 ? 0 : 1;
        double helper[3] = {least == 0 ? 1.0 : 0.0, least == 1 ? 1.0 : 0.0, 0.0};
        double u[3];
        double v[3];
        const double* const d = ray.direction;
        for (int i = 0; i < 3; ++i) u[i] = d[(i + 1) % 3] * helper[(i + 2) % 3] - d[(i + 2) % 3] * helper[(i + 1) % 3];
        const double length = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        for (double& component : u) component /= length;
        for (int i = 0; i < 3; ++i) v[i] = d[(i + 1) % 3] * u[(i + 2) % 3] - d[(i + 2) % 3] * u[(i + 1) % 3];
        for (int i = 0; i < 3; ++i) across[i] = radius * (a * u[i] + b * v[i]);
    }
    for (int axis = 0; axis < 3; ++axis) {
        ray.origin_mm[axis] = 0.5 * volume.extent_mm_xyz[axis] + across[axis] - radius * ray.direction[axis];
    }
    ray.length_mm = 2.0 * radius;
    return ray;
}

// Goes to a place that is seen from outside. False where no ray was stopped.
template <typename Voxel>
bool find_seen(const light::Medium<Voxel>& medium, const OracleVolume& volume, light::Stream& stream, double place[3],
               double& value) noexcept {
    for (int k = 0; k < kTries; ++k) {
        const oracle::Ray ray = random_ray(volume, stream);
        double from_mm = 0.0;
        double to_mm = 0.0;
        if (!oracle::clip_to_box(ray, volume.extent_mm_xyz, from_mm, to_mm)) continue;
        if (!medium.cut.clip(ray.origin_mm, ray.direction, from_mm, to_mm)) continue;
        for (int axis = 0; axis < 3; ++axis) {
            place[axis] = (ray.origin_mm[axis] + from_mm * ray.direction[axis]) / medium.spacing_mm[axis] - 0.5;
        }
        if (light::stopped(medium, place, ray.direction, to_mm - from_mm, stream, value)) return true;
    }
    return false;
}

// Goes to a place where light toward a seen place was last stopped. False where none was found.
template <typename Voxel>
bool find_lighting(const light::Medium<Voxel>& medium, const OracleVolume& volume, double reach_mm,
                   light::Stream& stream, double place[3], double& value) noexcept {
    for (int k = 0; k < kBounceTries; ++k) {
        if (!find_seen(medium, volume, stream, place, value)) return false;
        double way[3];
        stream.direction(way);
        if (light::stopped(medium, place, way, reach_mm, stream, value)) return true;
    }
    return false;
}

// Goes to a random place that has extinction. False where none was found.
template <typename Voxel>
bool find_inner(const light::Medium<Voxel>& medium, light::Stream& stream, double place[3], double& value) noexcept {
    for (int k = 0; k < kTries; ++k) {
        for (int axis = 0; axis < 3; ++axis) place[axis] = stream.uniform() * (medium.end[axis] + 0.5) - 0.5;
        double at_mm[3];
        medium.millimetres(place, at_mm);
        if (!medium.cut.hold(at_mm)) continue;
        value = medium.value_at(place);
        if (medium.function->extinction(value) > 0.0) return true;
    }
    return false;
}

// Mean [3] of several paths from a place. Where light is known, every eight rays are one random direction and its
// mirror images, one in each octant, which have less noise than eight random ones.
template <typename Voxel>
void mean_light(const light::Medium<Voxel>& medium, const light::Surroundings& around, const LightSamples& samples,
                const double place[3], light::Stream& stream, double mean[3]) noexcept {
    std::fill_n(mean, 3, 0.0);
    double drawn[3] = {0.0, 0.0, 0.0};
    for (int64_t path = 0; path < samples.paths; ++path) {
        double arriving[3];
        if (samples.known == nullptr || around.lamp_mm != nullptr) {
            light::gathered(medium, around, place, stream, arriving);
        } else {
            if (path % 8 == 0) stream.direction(drawn);
            double way[3];
            for (int axis = 0; axis < 3; ++axis) way[axis] = (path >> axis & 1) != 0 ? -drawn[axis] : drawn[axis];
            light::gathered_near(medium, around, *samples.known, samples.bounces, place, way, stream, arriving);
        }
        for (int c = 0; c < 3; ++c) mean[c] += arriving[c] / static_cast<double>(samples.paths);
    }
}

}  // namespace

template <typename Voxel>
void light_samples(const Voxel* voxels, const OracleVolume& volume, const light::Function& function,
                   const light::Surroundings& around, const LightSamples& samples, int threads) {
    const light::Medium<Voxel> medium = light::make_medium(voxels, volume, function, threads);
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 256)
    for (int64_t k = 0; k < samples.count; ++k) {
        const int64_t index = samples.first + k;
        light::Stream stream(samples.seed, static_cast<uint64_t>(index));
        const bool inner = samples.inner_each > 0 && index % samples.inner_each == 0;
        double place[3] = {0.0, 0.0, 0.0};
        double value = 0.0;
        double mean[3] = {0.0, 0.0, 0.0};
        const bool found = inner              ? find_inner(medium, stream, place, value)
                           : samples.lighting ? find_lighting(medium, volume, around.reach_mm, stream, place, value)
                                              : find_seen(medium, volume, stream, place, value);
        samples.kinds[k] = static_cast<uint8_t>(!found ? 0 : inner ? 2 : 1);
        if (found) mean_light(medium, around, samples, place, stream, mean);
        for (int axis = 0; axis < 3; ++axis) {
            samples.places[4 * k + axis] = static_cast<float>((place[axis] + 0.5) * medium.spacing_mm[axis]);
            samples.light[3 * k + axis] = static_cast<float>(mean[axis]);
        }
        samples.places[4 * k + 3] = static_cast<float>(value);
    }
}

#define VOLPREP_SAMPLES(Voxel)                                                                                         \
    template void light_samples(const Voxel*, const OracleVolume&, const light::Function&, const light::Surroundings&, \
                                const LightSamples&, int);
VOLPREP_SAMPLES(uint8_t)
VOLPREP_SAMPLES(int16_t)
VOLPREP_SAMPLES(uint16_t)
VOLPREP_SAMPLES(float)
#undef VOLPREP_SAMPLES

}  // namespace volprep
