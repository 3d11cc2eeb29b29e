// Light that reaches a place in a medium, estimated by one random path. Every estimate is unbiased but for paths that
// reach the limit of collisions; what these can still be worth is counted.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "volprep/light/flight.hpp"
#include "volprep/light/stored.hpp"

namespace volprep::light {

// Light from a cone of directions. An unshadowed place gets `colour`.
struct Sun {
    double direction[3];  // towards it, of length 1
    double colour[3];
    double cosine;  // of the cone's half angle
};

// The light around a volume. Each part is what an unshadowed place gets as its mean over directions.
struct Surroundings {
    double sky[3][4];  // of each channel: light from everywhere, and its change along the box's axes x, y and z
    int64_t sun_count;
    const Sun* suns;
    const double* lamp_mm;  // a light at a place [3] instead of all of these, or none
    double ambient;         // with a lamp: part of the light that is there in shadow
    double reach_mm;        // matter farther away blocks no light
    bool scatters;          // whether light that is stopped goes on; if not, it is lost

    void sky_from(const double direction[3], double out[3]) const noexcept {
        for (int c = 0; c < 3; ++c) {
            out[c] = sky[c][0] + sky[c][1] * direction[0] + sky[c][2] * direction[1] + sky[c][3] * direction[2];
        }
    }
    // No place can get more in any channel without suns.
    double brightest() const noexcept {
        double most = 0.0;
        for (const double* const of : sky) {
            most = std::max(most, of[0] + std::sqrt(of[1] * of[1] + of[2] * of[2] + of[3] * of[3]));
        }
        return lamp_mm == nullptr ? most : 1.0;
    }
};

// Collisions after which a path is given up.
inline constexpr int kMostCollisions = 100000;
// A path that carries less than this goes on with a chance in proportion, so that the expected value stays.
inline constexpr double kFaint = 0.1;

inline void direction_in_cone(const Sun& sun, Stream& stream, double out[3]) noexcept {
    // A point of the sphere near the axis: the axis times the cosine, and a random perpendicular vector.
    const double cosine = 1.0 - stream.uniform() * (1.0 - sun.cosine);
    double random[3];
    double along = 1.0;
    double length = 0.0;
    while (!(length > 1e-6)) {
        stream.direction(random);
        along = random[0] * sun.direction[0] + random[1] * sun.direction[1] + random[2] * sun.direction[2];
        length = 1.0 - along * along;
    }
    const double scale = std::sqrt(std::max(1.0 - cosine * cosine, 0.0) / length);
    for (int axis = 0; axis < 3; ++axis) {
        out[axis] = sun.direction[axis] * (cosine - along * scale) + random[axis] * scale;
    }
}

template <typename Voxel>
double lamp_light(const Medium<Voxel>& medium, const Surroundings& around, const double place[3],
                  Stream& stream) noexcept {
    double way[3];
    double length = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        way[axis] = around.lamp_mm[axis] - (place[axis] + 0.5) * medium.spacing_mm[axis];
        length += way[axis] * way[axis];
    }
    length = std::sqrt(length);
    if (length == 0.0) return 1.0;
    for (double& component : way) component /= length;
    double at[3] = {place[0], place[1], place[2]};
    double value = 0.0;
    const bool dark = stopped(medium, at, way, std::min(length, around.reach_mm), stream, value);
    return dark ? around.ambient : 1.0;
}

// Adds what suns send straight to a place, times `weight`.
template <typename Voxel>
void add_suns(const Medium<Voxel>& medium, const Surroundings& around, const double place[3], const double weight[3],
              Stream& stream, double light[3]) noexcept {
    for (int64_t i = 0; i < around.sun_count; ++i) {
        double way[3];
        direction_in_cone(around.suns[i], stream, way);
        double at[3] = {place[0], place[1], place[2]};
        double value = 0.0;
        if (stopped(medium, at, way, around.reach_mm, stream, value)) continue;
        for (int c = 0; c < 3; ++c) light[c] += weight[c] * around.suns[i].colour[c];
    }
}

// Makes a faint path end or carry more. False where it ends.
inline bool survives(double weight[3], Stream& stream) noexcept {
    const double most = std::max({weight[0], weight[1], weight[2]});
    if (most >= kFaint) return true;
    if (!(stream.uniform() * kFaint < most)) return false;
    for (int c = 0; c < 3; ++c) weight[c] *= kFaint / most;
    return true;
}

// Light [3] at a place in index coordinates, by one path; unshadowed it is sky and suns, or 1 with a lamp. Returns what
// a path that was given up could still have brought, 0 for all others.
template <typename Voxel>
double gathered(const Medium<Voxel>& medium, const Surroundings& around, const double from[3], Stream& stream,
                double light[3]) noexcept {
    std::fill_n(light, 3, 0.0);
    if (around.lamp_mm != nullptr) {
        std::fill_n(light, 3, lamp_light(medium, around, from, stream));
        return 0.0;
    }
    double place[3] = {from[0], from[1], from[2]};
    double weight[3] = {1.0, 1.0, 1.0};
    for (int collisions = 0; collisions < kMostCollisions; ++collisions) {
        add_suns(medium, around, place, weight, stream, light);
        double way[3];
        stream.direction(way);
        double value = 0.0;
        if (!stopped(medium, place, way, around.reach_mm, stream, value)) {
            double sky[3];
            around.sky_from(way, sky);
            for (int c = 0; c < 3; ++c) light[c] += weight[c] * sky[c];
            return 0.0;
        }
        if (!around.scatters) return 0.0;
        double albedo[3];
        medium.function->blend(medium.function->albedos, value, albedo);
        for (int c = 0; c < 3; ++c) weight[c] *= albedo[c];
        if (!survives(weight, stream)) return 0.0;
    }
    return std::max({weight[0], weight[1], weight[2]}) * around.brightest();
}

// Light [3] at a place in index coordinates, by one path that begins in the direction `way` and ends where it is
// stopped the last of `bounces` times, at least 1, with the light that `known` has there. It has less noise than a
// whole path. Errors of `known` are averaged over the places where paths end: more bounces leave less of them. Not for
// lamps.
template <typename Voxel>
void gathered_near(const Medium<Voxel>& medium, const Surroundings& around, const StoredLight& known, int64_t bounces,
                   const double from[3], const double way[3], Stream& stream, double light[3]) noexcept {
    std::fill_n(light, 3, 0.0);
    double place[3] = {from[0], from[1], from[2]};
    double weight[3] = {1.0, 1.0, 1.0};
    double next[3] = {way[0], way[1], way[2]};
    for (int64_t bounce = 1;; ++bounce) {
        add_suns(medium, around, place, weight, stream, light);
        double value = 0.0;
        double arriving[3];
        if (!stopped(medium, place, next, around.reach_mm, stream, value)) {
            around.sky_from(next, arriving);
            for (int c = 0; c < 3; ++c) light[c] += weight[c] * arriving[c];
            return;
        }
        if (!around.scatters) return;
        double albedo[3];
        medium.function->blend(medium.function->albedos, value, albedo);
        for (int c = 0; c < 3; ++c) weight[c] *= albedo[c];
        if (bounce == bounces) {
            double place_mm[3];
            for (int axis = 0; axis < 3; ++axis) place_mm[axis] = (place[axis] + 0.5) * medium.spacing_mm[axis];
            known.at(place_mm, value, arriving);
            for (int c = 0; c < 3; ++c) light[c] += weight[c] * arriving[c];
            return;
        }
        stream.direction(next);
    }
}

}  // namespace volprep::light
