// Forward: front to back, each sample kept. Backward: the light behind a sample is the whole light minus the light in
// front of it, so that a second pass gives all slopes. Rays are split into a fixed number of groups with sums of their
// own, so that the order of additions never depends on the threads.
#include "volprep/refine_level.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t groups = 4;
// Light from behind this changes no picture of 16 bits.
constexpr double least_transmittance = 1e-6;

// Where a sample lies between the centres of two voxels along an axis.
struct Place {
    int64_t lower;
    float upper_weight;
};

inline Place find_place(double position, int64_t voxels) noexcept {
    const double inside = std::clamp(position, 0.0, static_cast<double>(voxels - 1));
    const int64_t lower = std::min(static_cast<int64_t>(inside), std::max<int64_t>(voxels - 2, 0));
    return {lower, static_cast<float>(inside - static_cast<double>(lower))};
}

// The cell between voxels that a sample lies in, and where in it.
struct Spot {
    int64_t first;  // the lower corner's voxel
    float upper_weight[3];
};

inline Spot find_spot(const double* origin, const double* direction, double t, Shape3 shape) noexcept {
    const Place x = find_place(origin[0] + t * direction[0], shape.x);
    const Place y = find_place(origin[1] + t * direction[1], shape.y);
    const Place z = find_place(origin[2] + t * direction[2], shape.z);
    return {(z.lower * shape.y + y.lower) * shape.x + x.lower, {x.upper_weight, y.upper_weight, z.upper_weight}};
}

// Distance from a voxel to the next one along each axis, x first; 0 along an axis of one voxel.
struct Strides {
    int64_t along[3];

    explicit Strides(Shape3 shape) noexcept
        : along{shape.x > 1 ? 1 : 0, shape.y > 1 ? shape.x : 0, shape.z > 1 ? shape.slice() : 0} {}
};

// Calls each(voxel, weight) for the corners of a sample's cell.
template <typename Each>
inline void each_corner(const Spot& spot, const Strides& next, const Each& each) {
    const auto [x, y, z] = spot.upper_weight;
    for (int k = 0; k < 8; ++k) {
        const int64_t voxel =
            spot.first + (k & 1 ? next.along[0] : 0) + (k & 2 ? next.along[1] : 0) + (k & 4 ? next.along[2] : 0);
        each(voxel, (k & 1 ? x : 1.0F - x) * (k & 2 ? y : 1.0F - y) * (k & 4 ? z : 1.0F - z));
    }
}

// Whether a cell shows something, or would if a value changed, by its lower corner: samples elsewhere need no reading.
// A step takes 0.6 to 0.7 of the time.
std::vector<uint8_t> find_shown_cells(const float* level, Shape3 shape, const SlopedTable& table) {
    std::vector<int64_t> shown_before(static_cast<size_t>(table.entries) + 1);
    for (int64_t entry = 0; entry < table.entries; ++entry) {
        const bool shows = table.rgba[4 * entry + 3] > 0.0 || table.slopes[4 * entry + 3] != 0.0;
        shown_before[entry + 1] = shown_before[entry] + (shows ? 1 : 0);
    }
    const int64_t voxels = shape.voxels();
    std::vector<float> least(level, level + voxels);
    std::vector<float> most(level, level + voxels);
    for (const int64_t stride : Strides(shape).along) {
        // Upwards: the next voxel is still that of one axis less. Cells beyond the last voxel are never asked for.
        for (int64_t voxel = 0; voxel < voxels - stride; ++voxel) {
            least[voxel] = std::min(least[voxel], least[voxel + stride]);
            most[voxel] = std::max(most[voxel], most[voxel + stride]);
        }
    }
    const auto entry_of = [&](float value, int64_t aside) {
        const double position = std::clamp<double>(value, 0.0, 1.0) * static_cast<double>(table.entries - 1);
        return std::clamp<int64_t>(static_cast<int64_t>(position) + aside, 0, table.entries - 1);
    };
    std::vector<uint8_t> shown(static_cast<size_t>(voxels));
    for (int64_t voxel = 0; voxel < voxels; ++voxel) {
        // A mean of values may be rounded across an entry.
        shown[voxel] = shown_before[entry_of(most[voxel], 2) + 1] > shown_before[entry_of(least[voxel], -1)];
    }
    return shown;
}

// A sample that shows something, or would if its value changed.
struct Sample {
    Spot spot;
    double colour[3];
    double slope[4];  // of colour, and of optical depth
    double in_front;
    double through;
};

// The level that rays run through.
struct Field {
    const float* level;
    Shape3 shape;
    Strides next;
    std::vector<uint8_t> shown_cells;
};

// The ray that is worked on.
struct Ray {
    std::vector<Sample> samples;
    double light[4];
    int64_t number = 0;
};

void march(const SlopedTable& table, const Field& field, const Rays& rays, Ray& ray) {
    ray.samples.clear();
    std::fill_n(ray.light, 3, 0.0);
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
        float value = 0.0F;
        each_corner(spot, field.next, [&](int64_t voxel, float weight) { value += weight * field.level[voxel]; });
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
        Sample& sample = ray.samples.emplace_back();
        sample.spot = spot;
        sample.in_front = transmittance;
        sample.through = std::exp(-extinction_per_mm * segment_mm);
        const double shown = transmittance * (1.0 - sample.through);
        for (int c = 0; c < 3; ++c) {
            sample.colour[c] = mix(table.rgba, c);
            sample.slope[c] = mix(table.slopes, c);
            ray.light[c] += shown * sample.colour[c];
        }
        sample.slope[3] = slope * segment_mm;
        transmittance *= sample.through;
    }
    ray.light[3] = 1.0 - transmittance;
}

// Calls each(sample, slopes of the light's four channels by the sample's value) for each sample of a ray.
template <typename Each>
void each_slope(const Ray& ray, const Each& each) {
    double so_far[3] = {0.0, 0.0, 0.0};
    for (const Sample& sample : ray.samples) {
        const double shown = sample.in_front * (1.0 - sample.through);
        double by_value[4];
        for (int c = 0; c < 3; ++c) {
            so_far[c] += shown * sample.colour[c];
            const double behind = ray.light[c] - so_far[c];
            by_value[c] = sample.slope[c] * shown +
                          sample.slope[3] * (sample.in_front * sample.through * sample.colour[c] - behind);
        }
        by_value[3] = sample.slope[3] * (1.0 - ray.light[3]);
        each(sample, by_value);
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
    each_slope(ray, [&](const Sample&, const double* by_value) {
        for (int c = 0; c < 4; ++c) {
            total[c] += std::abs(by_value[c]);
        }
    });
    each_slope(ray, [&](const Sample& sample, const double* by_value) {
        double gradient = 0.0;
        double curvature = 0.0;
        for (int c = 0; c < 4; ++c) {
            gradient += by_value[c] * residual[c];
            curvature += std::abs(by_value[c]) * total[c];
        }
        if (curvature == 0.0) {
            return;
        }
        const auto down = static_cast<float>(weight * gradient);
        const auto bend = static_cast<float>(weight * curvature);
        each_corner(sample.spot, field.next, [&](int64_t voxel, float share) {
            float* const to = sums + refine_numbers * voxel;
            to[0] += share * down;
            to[1] += share * bend;
        });
    });
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
        for (ray.number = group; ray.number < rays.count; ray.number += groups) {
            costs[group] += add_ray(target, field, rays, ray, parts[group].data());
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
