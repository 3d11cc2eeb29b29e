// Means and variances of independent samples, a stream of random numbers for each pixel or place.
#include <algorithm>
#include <vector>

#include "volprep/light.hpp"
#include "volprep/light/make_medium.hpp"
#include "volprep/oracle/frame.hpp"
#include "volprep/threads.hpp"

namespace volprep {

namespace {

// Running mean and variance (Welford 1962).
template <int kChannels>
struct Mean {
    int64_t count = 0;
    double mean[kChannels] = {};
    double squares[kChannels] = {};

    void add(const double* sample) noexcept {
        ++count;
        for (int c = 0; c < kChannels; ++c) {
            const double off = sample[c] - mean[c];
            mean[c] += off / static_cast<double>(count);
            squares[c] += off * (sample[c] - mean[c]);
        }
    }
    void write(double* out, double* variance) const noexcept {
        const double pairs = static_cast<double>(count) * static_cast<double>(count - 1);
        for (int c = 0; c < kChannels; ++c) {
            out[c] = mean[c];
            variance[c] = squares[c] / pairs;
        }
    }
};

// One sample [4] of a ray that is inside the box from `from_mm` on for `length_mm`.
template <typename Voxel>
double ray_sample(const light::Medium<Voxel>& medium, const light::Surroundings& around, const oracle::Ray& ray,
                  double from_mm, double length_mm, light::Stream& stream, double rgba[4]) noexcept {
    std::fill_n(rgba, 4, 0.0);
    double place[3];
    for (int axis = 0; axis < 3; ++axis) {
        place[axis] = (ray.origin_mm[axis] + from_mm * ray.direction[axis]) / medium.spacing_mm[axis] - 0.5;
    }
    double value = 0.0;
    if (!light::stopped(medium, place, ray.direction, length_mm, stream, value)) return 0.0;
    double colour[3];
    medium.function->blend(medium.function->colours, value, colour);
    double arriving[3];
    const double missed = light::gathered(medium, around, place, stream, arriving);
    for (int c = 0; c < 3; ++c) rgba[c] = colour[c] * arriving[c];
    rgba[3] = 1.0;
    return missed * std::max({colour[0], colour[1], colour[2]});
}

}  // namespace

template <typename Voxel>
double trace_picture(const Voxel* voxels, const OracleVolume& volume, const light::Function& function,
                     const light::Surroundings& around, const TracedPicture& picture, int threads) {
    const light::Medium<Voxel> medium = light::make_medium(voxels, volume, function, threads);
    const int64_t pixels = picture.view.height * picture.view.width;
    double missed = 0.0;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 16) reduction(max : missed)
    for (int64_t i = 0; i < pixels; ++i) {
        const oracle::Ray ray = oracle::pixel_ray(picture.view, i / picture.view.width, i % picture.view.width);
        Mean<4> mean;
        double from_mm = 0.0;
        double to_mm = 0.0;
        const bool hits = ray.length_mm > 0.0 && oracle::clip_to_box(ray, volume.extent_mm_xyz, from_mm, to_mm) &&
                          volume.cut.clip(ray.origin_mm, ray.direction, from_mm, to_mm);
        light::Stream stream(picture.seed, static_cast<uint64_t>(i));
        double open = 0.0;
        for (int64_t k = 0; k < picture.paths; ++k) {
            double sample[4] = {0.0, 0.0, 0.0, 0.0};
            if (hits) open += ray_sample(medium, around, ray, from_mm, to_mm - from_mm, stream, sample);
            mean.add(sample);
        }
        mean.write(picture.rgba + 4 * i, picture.variance + 4 * i);
        missed = std::max(missed, open / static_cast<double>(picture.paths));
    }
    return missed;
}

template <typename Voxel>
double trace_places(const Voxel* voxels, const OracleVolume& volume, const light::Function& function,
                    const light::Surroundings& around, const TracedPlaces& places, int threads) {
    const light::Medium<Voxel> medium = light::make_medium(voxels, volume, function, threads);
    double missed = 0.0;
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 16) reduction(max : missed)
    for (int64_t i = 0; i < places.count; ++i) {
        double place[3];
        for (int axis = 0; axis < 3; ++axis) {
            place[axis] = places.places_mm[3 * i + axis] / volume.spacing_mm_xyz[axis] - 0.5;
        }
        light::Stream stream(places.seed, static_cast<uint64_t>(i));
        Mean<3> mean;
        double open = 0.0;
        for (int64_t k = 0; k < places.paths; ++k) {
            double sample[3];
            open += light::gathered(medium, around, place, stream, sample);
            mean.add(sample);
        }
        mean.write(places.light + 3 * i, places.variance + 3 * i);
        missed = std::max(missed, open / static_cast<double>(places.paths));
    }
    return missed;
}

#define VOLPREP_PATHS(Voxel)                                                                 \
    template double trace_picture(const Voxel*, const OracleVolume&, const light::Function&, \
                                  const light::Surroundings&, const TracedPicture&, int);    \
    template double trace_places(const Voxel*, const OracleVolume&, const light::Function&,  \
                                 const light::Surroundings&, const TracedPlaces&, int);
VOLPREP_PATHS(uint8_t)
VOLPREP_PATHS(int16_t)
VOLPREP_PATHS(uint16_t)
VOLPREP_PATHS(float)
#undef VOLPREP_PATHS

}  // namespace volprep
