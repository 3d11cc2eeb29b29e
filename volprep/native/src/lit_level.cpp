// The forward pass keeps the samples that show something, with the six places beside each; the backward pass takes the
// light behind a sample from the whole light. Rays are split into a fixed number of groups with sums of their own, so
// that the order of additions never depends on the threads.
#include "volprep/lit_level.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/level_cells.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t groups = 4;
// Light from behind this changes no picture of 8 bits.
constexpr double least_transmittance = 1e-4;
constexpr int beside = 6;

template <typename T>
struct Field {
    const T* level;
    Shape3 shape;
    double scale;
    Strides next;
    const uint8_t* shown_cells;  // null if every cell is read
};

struct Sample {
    Spot spot;
    Spot around[beside];  // above and below along x, y and z
    double shade_by[3];   // change of the shade with the value above along each axis; below it is the opposite
    double shade;
    double colour[3];
    double slope[4];  // of colour, and of optical depth
    double in_front;
    double through;
};

struct Ray {
    std::vector<Sample> samples;
    double light[4];
};

template <typename T>
inline double value_at(const Field<T>& field, const Spot& spot) noexcept {
    float value = 0.0F;
    each_corner(spot, field.next,
                [&](int64_t voxel, float weight) { value += weight * static_cast<float>(field.level[voxel]); });
    return static_cast<double>(value) * field.scale;
}

template <typename T>
void shade(const Field<T>& field, const Headlight& headlight, const double* place, const double* direction,
           Sample& sample) noexcept {
    double gradient[3];
    double along = 0.0;
    double squared = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        double values[2];
        for (int side = 0; side < 2; ++side) {
            double aside[3] = {0.0, 0.0, 0.0};
            aside[axis] = side == 0 ? headlight.apart_xyz[axis] : -headlight.apart_xyz[axis];
            Spot& spot = sample.around[2 * axis + side];
            spot = find_spot(place, aside, 1.0, field.shape);
            values[side] = value_at(field, spot);
        }
        const double apart_mm = 2.0 * headlight.apart_xyz[axis] * headlight.spacing_mm_xyz[axis];
        gradient[axis] = (values[0] - values[1]) / apart_mm;
        along += gradient[axis] * direction[axis] * headlight.spacing_mm_xyz[axis];
        squared += gradient[axis] * gradient[axis];
    }
    const double length = std::sqrt(squared);
    sample.shade = 1.0;
    std::fill_n(sample.shade_by, 3, 0.0);
    if (length < headlight.least_per_mm || length == 0.0) {
        return;
    }
    sample.shade = std::abs(along) / length;
    for (int axis = 0; axis < 3; ++axis) {
        const double apart_mm = 2.0 * headlight.apart_xyz[axis] * headlight.spacing_mm_xyz[axis];
        const double along_axis = direction[axis] * headlight.spacing_mm_xyz[axis];
        const double by_gradient = along_axis / length - along * gradient[axis] / (squared * length);
        sample.shade_by[axis] = (along < 0.0 ? -by_gradient : by_gradient) / apart_mm;
    }
}

template <typename T>
void march(const Field<T>& field, const Rays& rays, int64_t number, const Headlight& headlight,
           const SlopedTable& table, bool is_kept, Ray& ray) {
    ray.samples.clear();
    std::fill_n(ray.light, 3, 0.0);
    double transmittance = 1.0;
    const int64_t count = rays.offsets[number + 1] - rays.offsets[number];
    const double segment_mm = rays.length_mm[number] / static_cast<double>(count);
    const double* const origin = rays.origin_xyz + 3 * number;
    const double* const direction = rays.direction_xyz + 3 * number;
    for (int64_t i = 0; i < count && transmittance >= least_transmittance; ++i) {
        const double along_mm = (static_cast<double>(i) + 0.5) * segment_mm;
        Sample sample;
        sample.spot = find_spot(origin, direction, along_mm, field.shape);
        if (field.shown_cells != nullptr && field.shown_cells[sample.spot.first] == 0) {
            continue;
        }
        const double value = value_at(field, sample.spot);
        const double position = std::clamp(value, 0.0, 1.0) * static_cast<double>(table.entries - 1);
        const int64_t entry = std::min(static_cast<int64_t>(position), table.entries - 2);
        const double weight = position - static_cast<double>(entry);
        const auto mix = [&](const double* rows, int channel) {
            const double* const low = rows + 4 * entry + channel;
            return low[0] + weight * (low[4] - low[0]);
        };
        const double extinction_per_mm = mix(table.rgba, 3);
        const double slope = is_kept ? mix(table.slopes, 3) : 0.0;
        if (extinction_per_mm <= 0.0 && slope == 0.0) {
            continue;
        }
        const double place[3] = {origin[0] + along_mm * direction[0], origin[1] + along_mm * direction[1],
                                 origin[2] + along_mm * direction[2]};
        shade(field, headlight, place, direction, sample);
        sample.in_front = transmittance;
        sample.through = std::exp(-extinction_per_mm * segment_mm);
        const double shown = transmittance * (1.0 - sample.through);
        for (int c = 0; c < 3; ++c) {
            sample.colour[c] = mix(table.rgba, c);
            ray.light[c] += shown * sample.colour[c] * sample.shade;
        }
        transmittance *= sample.through;
        if (is_kept) {
            for (int c = 0; c < 3; ++c) {
                sample.slope[c] = mix(table.slopes, c);
            }
            sample.slope[3] = slope * segment_mm;
            ray.samples.push_back(sample);
        }
    }
    ray.light[3] = 1.0 - transmittance;
}

// Calls each(sample, slopes of the light's four channels by the sample's value, opacity that is seen of it).
template <typename Each>
void each_slope(const Ray& ray, const Each& each) {
    double so_far[3] = {0.0, 0.0, 0.0};
    for (const Sample& sample : ray.samples) {
        const double shown = sample.in_front * (1.0 - sample.through);
        double by_value[4];
        for (int c = 0; c < 3; ++c) {
            const double colour = sample.colour[c] * sample.shade;
            so_far[c] += shown * colour;
            const double behind = ray.light[c] - so_far[c];
            by_value[c] = sample.slope[c] * sample.shade * shown +
                          sample.slope[3] * (sample.in_front * sample.through * colour - behind);
        }
        by_value[3] = sample.slope[3] * (1.0 - ray.light[3]);
        each(sample, by_value, shown);
    }
}

inline void add(const Spot& spot, const Strides& next, double down, double bend, float* sums) noexcept {
    const auto down_of = static_cast<float>(down);
    const auto bend_of = static_cast<float>(bend);
    each_corner(spot, next, [&](int64_t voxel, float share) {
        float* const to = sums + refine_numbers * voxel;
        to[0] += share * down_of;
        to[1] += share * bend_of;
    });
}

// Adds what one ray says; returns its weighted squared error.
double add_ray(const RefineTarget& target, int64_t number, const Strides& next, const Ray& ray, float* sums) {
    const double weight = target.weight[number];
    double residual[4];
    double cost = 0.0;
    for (int c = 0; c < 4; ++c) {
        residual[c] = ray.light[c] - target.light[4 * number + c];
        cost += weight * residual[c] * residual[c];
    }
    double total[4] = {};
    each_slope(ray, [&](const Sample& sample, const double* by_value, double shown) {
        double by_shade = 0.0;
        for (const double by : sample.shade_by) {
            by_shade += 2.0 * std::abs(by);
        }
        for (int c = 0; c < 4; ++c) {
            total[c] += std::abs(by_value[c]) + (c < 3 ? shown * sample.colour[c] * by_shade : 0.0);
        }
    });
    each_slope(ray, [&](const Sample& sample, const double* by_value, double shown) {
        double down = 0.0;
        double bend = 0.0;
        double down_by_shade = 0.0;
        double bend_by_shade = 0.0;
        for (int c = 0; c < 4; ++c) {
            down += by_value[c] * residual[c];
            bend += std::abs(by_value[c]) * total[c];
        }
        for (int c = 0; c < 3; ++c) {
            down_by_shade += shown * sample.colour[c] * residual[c];
            bend_by_shade += shown * sample.colour[c] * total[c];
        }
        if (bend > 0.0) {
            add(sample.spot, next, weight * down, weight * bend, sums);
        }
        for (int side = 0; side < beside && bend_by_shade > 0.0; ++side) {
            const double by = side % 2 == 0 ? sample.shade_by[side / 2] : -sample.shade_by[side / 2];
            if (by != 0.0) {
                add(sample.around[side], next, weight * down_by_shade * by, weight * bend_by_shade * std::abs(by),
                    sums);
            }
        }
    });
    return cost;
}

}  // namespace

template <typename T>
void lit_light(const T* src, Shape3 shape, double scale, const Rays& rays, const Headlight& headlight,
               const SlopedTable& table, double* light, int threads) {
    const Field<T> field{src, shape, scale, Strides(shape), nullptr};
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 64)
    for (int64_t number = 0; number < rays.count; ++number) {
        Ray ray;
        march(field, rays, number, headlight, table, false, ray);
        std::copy_n(ray.light, 4, light + 4 * number);
    }
}

template void lit_light<uint8_t>(const uint8_t*, Shape3, double, const Rays&, const Headlight&, const SlopedTable&,
                                 double*, int);
template void lit_light<uint16_t>(const uint16_t*, Shape3, double, const Rays&, const Headlight&, const SlopedTable&,
                                  double*, int);

double lit_sums(const float* level, Shape3 shape, const Rays& rays, const Headlight& headlight,
                const RefineTarget& target, float* sums, int threads) {
    const int64_t numbers = refine_numbers * shape.voxels();
    std::vector<std::vector<float>> parts(groups, std::vector<float>(static_cast<size_t>(numbers)));
    const std::vector<uint8_t> shown_cells = find_shown_cells(level, shape, target.table);
    const Field<float> field{level, shape, 1.0, Strides(shape), shown_cells.data()};
    double costs[groups] = {};
    std::vector<Ray> work(groups);
    int64_t longest = 0;
    for (int64_t ray = 0; ray < rays.count; ++ray) {
        longest = std::max(longest, rays.offsets[ray + 1] - rays.offsets[ray]);
    }
    for (Ray& ray : work) {
        ray.samples.reserve(static_cast<size_t>(longest));
    }
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static, 1)
    for (int64_t group = 0; group < groups; ++group) {
        for (int64_t number = group; number < rays.count; number += groups) {
            march(field, rays, number, headlight, target.table, true, work[group]);
            costs[group] += add_ray(target, number, field.next, work[group], parts[group].data());
        }
    }
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t i = 0; i < numbers; ++i) {
        for (int64_t group = 0; group < groups; ++group) {
            sums[i] += parts[group][i];
        }
    }
    return ((costs[0] + costs[1]) + costs[2]) + costs[3];
}

}  // namespace volprep
