// Forward: front to back, each sample kept. Backward: the light behind a sample is the whole light minus the light in
// front of it, so that a second pass gives all slopes. Rays are split into a fixed number of groups with sums of their
// own, so that the order of additions never depends on the threads.
#include "volprep/refine_level.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/level_cells.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t groups = 4;
// Light from behind this changes no picture of 16 bits.
constexpr double least_transmittance = 1e-6;

// A sample that shows something, or would if its value changed.
struct Sample {
    int64_t first;    // the voxel at the lower corner of its cell
    float shares[8];  // of the voxels at the corners of the cell in its value
    double colour[3];
    double slope[4];  // of colour, and of optical depth
    double in_front;
    double through;
    double by_value[4];  // slopes of the light's channels by the sample's value
};

// The level that rays run through.
struct Field {
    const float* level;
    Shape3 shape;
    Strides next;
    std::vector<uint8_t> shown_cells;
};

// The ray that is worked on. Threads write to theirs for each sample: no two share a line of cache.
struct alignas(64) Ray {
    std::vector<Sample> samples;
    double light[4];
    int64_t number = 0;
};

void march(const SlopedTable& table, const Field& field, const Rays& rays, Ray& ray) {
    ray.samples.clear();
    double light[3] = {0.0, 0.0, 0.0};
    double transmittance = 1.0;
    const int64_t count = rays.offsets[ray.number + 1] - rays.offsets[ray.number];
    const double segment_mm = rays.length_mm[ray.number] / static_cast<double>(count);
    const double* const origin = rays.origin_xyz + 3 * ray.number;
    const double* const direction = rays.direction_xyz + 3 * ray.number;
    for (int64_t i = 0; i < count && transmittance >= least_transmittance; ++i) {
        const Spot spot = find_spot(origin, direction, (static_cast<double>(i) + 0.5) * segment_mm, field.shape);
        if (field.shown_cells[spot.first] == 0) {
            continue;
        }
        Sample sample;
        sample.first = spot.first;
        float value = 0.0F;
        int corner = 0;
        each_corner(spot, field.next, [&](int64_t voxel, float share) {
            sample.shares[corner++] = share;
            value += share * field.level[voxel];
        });
        const double position = std::clamp<double>(value, 0.0, 1.0) * static_cast<double>(table.entries - 1);
        const int64_t entry = std::min(static_cast<int64_t>(position), table.entries - 2);
        const double weight = position - static_cast<double>(entry);
        const auto mix = [&](const double* rows, int channel) {
            const double* const low = rows + 4 * entry + channel;
            return low[0] + weight * (low[4] - low[0]);
        };
        const double extinction_per_mm = mix(table.rgba, 3);
        const double slope = mix(table.slopes, 3);
        if (extinction_per_mm <= 0.0 && slope == 0.0) {
            continue;
        }
        sample.in_front = transmittance;
        sample.through = std::exp(-extinction_per_mm * segment_mm);
        const double shown = transmittance * (1.0 - sample.through);
        for (int c = 0; c < 3; ++c) {
            sample.colour[c] = mix(table.rgba, c);
            sample.slope[c] = mix(table.slopes, c);
            light[c] += shown * sample.colour[c];
        }
        sample.slope[3] = slope * segment_mm;
        transmittance *= sample.through;
        ray.samples.push_back(sample);
    }
    std::copy_n(light, 3, ray.light);
    ray.light[3] = 1.0 - transmittance;
}

// Finds the slopes of the light's four channels by the value of each sample; adds their sizes to `total`.
void find_slopes(Ray& ray, double* total) {
    double so_far[3] = {0.0, 0.0, 0.0};
    for (Sample& sample : ray.samples) {
        const double shown = sample.in_front * (1.0 - sample.through);
        for (int c = 0; c < 3; ++c) {
            so_far[c] += shown * sample.colour[c];
            const double behind = ray.light[c] - so_far[c];
            sample.by_value[c] = sample.slope[c] * shown +
                                 sample.slope[3] * (sample.in_front * sample.through * sample.colour[c] - behind);
        }
        sample.by_value[3] = sample.slope[3] * (1.0 - ray.light[3]);
        for (int c = 0; c < 4; ++c) {
            total[c] += std::abs(sample.by_value[c]);
        }
    }
}

// Adds two numbers to each voxel at the corners of a sample's cell, by its share.
inline void add_to_corners(const Sample& sample, const Strides& next, float down, float bend, float* sums) {
    const auto [next_x, next_y, next_z] = next.along;
    float* const cell = sums + refine_numbers * sample.first;
    const int64_t rows[4] = {0, next_y, next_z, next_z + next_y};
    for (int row = 0; row < 4; ++row) {
        float* const to = cell + refine_numbers * rows[row];
        const float* const shares = sample.shares + 2 * row;
        if (next_x == 1) {
            // Four numbers beside each other: one vector.
            const float added[4] = {shares[0] * down, shares[0] * bend, shares[1] * down, shares[1] * bend};
            float moved[4];
            std::copy_n(to, 4, moved);
            for (int k = 0; k < 4; ++k) moved[k] += added[k];
            std::copy_n(moved, 4, to);
            continue;
        }
        for (int k = 0; k < 2; ++k) {
            to[0] += shares[k] * down;
            to[1] += shares[k] * bend;
        }
    }
}

// Adds what one ray says through one table; returns its weighted squared error.
double add_ray(const RefineTarget& target, const Field& field, const Rays& rays, Ray& ray, float* sums) {
    march(target.table, field, rays, ray);
    const double weight = target.weight[ray.number];
    double residual[4];
    double cost = 0.0;
    for (int c = 0; c < 4; ++c) {
        residual[c] = ray.light[c] - target.light[4 * ray.number + c];
        cost += weight * residual[c] * residual[c];
    }
    double total[4] = {};
    find_slopes(ray, total);
    for (const Sample& sample : ray.samples) {
        double gradient = 0.0;
        double curvature = 0.0;
        for (int c = 0; c < 4; ++c) {
            gradient += sample.by_value[c] * residual[c];
            curvature += std::abs(sample.by_value[c]) * total[c];
        }
        if (curvature != 0.0) {
            add_to_corners(sample, field.next, static_cast<float>(weight * gradient),
                           static_cast<float>(weight * curvature), sums);
        }
    }
    return cost;
}

}  // namespace

double refine_sums(const float* level, Shape3 shape, const Rays& rays, const RefineTarget& target, float* sums,
                   int threads) {
    const int64_t numbers = refine_numbers * shape.voxels();
    std::vector<std::vector<float>> parts(groups, std::vector<float>(static_cast<size_t>(numbers)));
    const Field field{level, shape, Strides(shape), find_shown_cells(level, shape, target.table)};
    std::vector<Ray> work(groups);
    double costs[groups] = {};
    const int64_t longest = [&] {
        int64_t most = 0;
        for (int64_t ray = 0; ray < rays.count; ++ray) {
            most = std::max(most, rays.offsets[ray + 1] - rays.offsets[ray]);
        }
        return most;
    }();
    for (Ray& ray : work) {
        ray.samples.reserve(static_cast<size_t>(longest));
    }
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static, 1)
    for (int64_t group = 0; group < groups; ++group) {
        Ray& ray = work[group];
        double cost = 0.0;
        for (ray.number = group; ray.number < rays.count; ray.number += groups) {
            cost += add_ray(target, field, rays, ray, parts[group].data());
        }
        costs[group] = cost;
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
