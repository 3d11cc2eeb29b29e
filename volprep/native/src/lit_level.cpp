// The forward pass keeps the samples that show something; the backward pass takes the light behind a sample from the
// whole light. A sample and the six places beside it read at most 32 voxels, most of them once: the planes between
// voxels along an axis, each weighted along the other two. Rays are split into a fixed number of groups with sums of
// their own, so that the order of additions never depends on the threads.
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
constexpr double least_transmittance = 2e-3;
// Cells along an edge of the blocks that rays pass at once if they show nothing.
constexpr int64_t block_edge = 4;
// Steps by which a ray stops short of the end of such a block: more than is rounded away.
constexpr double skip_margin = 1e-6;
constexpr int planes = 4;

// Blocks of cells that show something.
struct ShownBlocks {
    Shape3 shape;
    std::vector<uint8_t> shown;
};

template <typename T>
struct Field {
    const T* level;
    Shape3 shape;
    double scale;
    Strides next;
    const ShownBlocks& blocks;
    const uint8_t* shown_cells;  // null if every cell of a block that shows something is read
};

// Weights of the planes of voxels around a sample along one axis; the sample lies between the planes 1 and 2.
struct Across {
    float between[2];      // of the planes 1 and 2, at the sample
    float slope[planes];   // of the value above less that below
    float spread[planes];  // of their sum
};

struct Sample {
    int64_t first;  // the lower corner of its cell
    Across across[3];
    double shade_by[3];  // change of the shade with the value above along each axis; below it is the opposite
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
ShownBlocks find_shown_blocks(const T* level, Shape3 shape, double scale, const SlopedTable& table, bool is_kept,
                              int threads) {
    // As find_shown_cells: a block is shown if an entry between its least and its greatest value is.
    std::vector<int64_t> shown_before(static_cast<size_t>(table.entries) + 1);
    for (int64_t entry = 0; entry < table.entries; ++entry) {
        const bool shows = table.rgba[4 * entry + 3] > 0.0 || (is_kept && table.slopes[4 * entry + 3] != 0.0);
        shown_before[entry + 1] = shown_before[entry] + (shows ? 1 : 0);
    }
    const auto entry_of = [&](T value, int64_t aside) {
        const double position =
            std::clamp(static_cast<double>(value) * scale, 0.0, 1.0) * static_cast<double>(table.entries - 1);
        return std::clamp<int64_t>(static_cast<int64_t>(position) + aside, 0, table.entries - 1);
    };
    const auto blocks_of = [](int64_t voxels) { return (voxels + block_edge - 1) / block_edge; };
    const Shape3 blocks{blocks_of(shape.z), blocks_of(shape.y), blocks_of(shape.x)};
    ShownBlocks found{blocks, std::vector<uint8_t>(static_cast<size_t>(blocks.voxels()))};
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t block_z = 0; block_z < blocks.z; ++block_z) {
        std::vector<T> least(static_cast<size_t>(blocks.x));
        std::vector<T> most(static_cast<size_t>(blocks.x));
        for (int64_t block_y = 0; block_y < blocks.y; ++block_y) {
            const int64_t z_begin = block_z * block_edge;
            const int64_t y_begin = block_y * block_edge;
            for (int64_t block_x = 0; block_x < blocks.x; ++block_x) {
                const int64_t x_begin = block_x * block_edge;
                T low = level[(z_begin * shape.y + y_begin) * shape.x + x_begin];
                T high = low;
                // Cells of a block end at the first voxels of the next one.
                for (int64_t z = z_begin; z <= std::min(z_begin + block_edge, shape.z - 1); ++z) {
                    for (int64_t y = y_begin; y <= std::min(y_begin + block_edge, shape.y - 1); ++y) {
                        const T* const row = level + (z * shape.y + y) * shape.x;
                        for (int64_t x = x_begin; x <= std::min(x_begin + block_edge, shape.x - 1); ++x) {
                            low = std::min(low, row[x]);
                            high = std::max(high, row[x]);
                        }
                    }
                }
                // A mean of values may be rounded across an entry.
                found.shown[(block_z * blocks.y + block_y) * blocks.x + block_x] =
                    shown_before[entry_of(high, 2) + 1] > shown_before[entry_of(low, -1)];
            }
        }
    }
    return found;
}

// Returns the number of samples of a ray from `sample` on, at least 1, that lie in its block of cells; `place` and
// `stride` are in voxels.
inline int64_t samples_in_block(const double* place, const double* stride, const int64_t* block,
                                int64_t left) noexcept {
    double steps = static_cast<double>(left);
    for (int axis = 0; axis < 3; ++axis) {
        // The outer blocks also hold the outer half voxels: at most one more look.
        const double begin = static_cast<double>(block[axis] * block_edge);
        if (stride[axis] > 0.0) {
            steps = std::min(steps, (begin + block_edge - place[axis]) / stride[axis]);
        } else if (stride[axis] < 0.0) {
            steps = std::min(steps, (begin - place[axis]) / stride[axis]);
        }
    }
    return std::max<int64_t>(1, static_cast<int64_t>(std::ceil(steps - skip_margin)));
}

// Writes the weights of the planes around a place between the centres of the outer voxels.
inline int64_t set_weights(double place, double apart, int64_t voxels, Across& across) noexcept {
    const Place centre = find_place(place, voxels);
    across.between[0] = 1.0F - centre.upper_weight;
    across.between[1] = centre.upper_weight;
    std::fill_n(across.slope, planes, 0.0F);
    std::fill_n(across.spread, planes, 0.0F);
    for (const double side : {1.0, -1.0}) {
        Place aside = find_place(place + side * apart, voxels);
        // A place just below the next cell may have been rounded up into it.
        if (aside.lower > centre.lower + 1) {
            aside = {centre.lower + 1, 1.0F};
        }
        const int64_t plane = aside.lower - centre.lower + 1;
        const float weights[2] = {1.0F - aside.upper_weight, aside.upper_weight};
        for (int64_t k = 0; k < 2; ++k) {
            across.slope[plane + k] += static_cast<float>(side) * weights[k];
            across.spread[plane + k] += weights[k];
        }
    }
    return centre.lower;
}

// Calls each(plane, distance to its voxels from those of plane 1) for the planes beside a cell that matter.
template <typename Each>
inline void each_plane_beside(const Across& across, int64_t stride, const Each& each) {
    for (const int64_t plane : {0, 3}) {
        if (across.spread[plane] > 0.0F) {
            each(plane, (plane - 1) * stride);
        }
    }
}

// The value at a sample.
template <typename T>
double read_cell(const Field<T>& field, const Sample& sample, float* corners) noexcept {
    float value = 0.0F;
    for (int k = 0; k < 8; ++k) {
        const int64_t voxel = sample.first + (k & 1 ? field.next.along[0] : 0) + (k & 2 ? field.next.along[1] : 0) +
                              (k & 4 ? field.next.along[2] : 0);
        corners[k] = static_cast<float>(field.level[voxel]);
        value += sample.across[0].between[k & 1] * sample.across[1].between[k >> 1 & 1] *
                 sample.across[2].between[k >> 2] * corners[k];
    }
    return static_cast<double>(value) * field.scale;
}

template <typename T>
void shade(const Field<T>& field, const Headlight& headlight, const double* direction, const float* corners,
           Sample& sample) noexcept {
    double gradient[3];
    double along = 0.0;
    double squared = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const int one = (axis + 1) % 3;
        const int other = (axis + 2) % 3;
        const Across& across = sample.across[axis];
        float difference = 0.0F;
        for (int k = 0; k < 4; ++k) {
            const float weight = sample.across[one].between[k & 1] * sample.across[other].between[k >> 1];
            const int corner = (k & 1) << one | (k >> 1) << other;
            float along_axis = across.slope[1] * corners[corner] + across.slope[2] * corners[corner | 1 << axis];
            const int64_t voxel =
                sample.first + (k & 1 ? field.next.along[one] : 0) + (k >> 1 ? field.next.along[other] : 0);
            each_plane_beside(across, field.next.along[axis], [&](int64_t plane, int64_t apart) {
                along_axis += across.slope[plane] * static_cast<float>(field.level[voxel + apart]);
            });
            difference += weight * along_axis;
        }
        const double apart_mm = 2.0 * headlight.apart_xyz[axis] * headlight.spacing_mm_xyz[axis];
        gradient[axis] = static_cast<double>(difference) * field.scale / apart_mm;
        along += gradient[axis] * direction[axis] * headlight.spacing_mm_xyz[axis];
        squared += gradient[axis] * gradient[axis];
    }
    // sqrt((along^2 + soft^2) / (squared + soft^2)), and how it changes with each value beside.
    const double soft = headlight.soft_per_mm * headlight.soft_per_mm;
    sample.shade = std::sqrt((along * along + soft) / (squared + soft));
    for (int axis = 0; axis < 3; ++axis) {
        const double apart_mm = 2.0 * headlight.apart_xyz[axis] * headlight.spacing_mm_xyz[axis];
        const double along_axis = direction[axis] * headlight.spacing_mm_xyz[axis];
        const double by_gradient =
            sample.shade * (along * along_axis / (along * along + soft) - gradient[axis] / (squared + soft));
        sample.shade_by[axis] = by_gradient / apart_mm;
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
    const double stride[3] = {direction[0] * segment_mm, direction[1] * segment_mm, direction[2] * segment_mm};
    const int64_t voxels[3] = {field.shape.x, field.shape.y, field.shape.z};
    Sample sample;
    int64_t next = 0;
    for (int64_t i = 0; i < count && transmittance >= least_transmittance; i = next) {
        next = i + 1;
        const double along_mm = (static_cast<double>(i) + 0.5) * segment_mm;
        // In the outer half voxels values and gradients are those of the outer voxels.
        double place[3];
        int64_t lower[3];
        int64_t block[3];
        for (int axis = 0; axis < 3; ++axis) {
            place[axis] =
                std::clamp(origin[axis] + along_mm * direction[axis], 0.0, static_cast<double>(voxels[axis] - 1));
            lower[axis] = find_place(place[axis], voxels[axis]).lower;
            block[axis] = lower[axis] / block_edge;
        }
        const Shape3& blocks = field.blocks.shape;
        if (field.blocks.shown[(block[2] * blocks.y + block[1]) * blocks.x + block[0]] == 0) {
            next = i + samples_in_block(place, stride, block, count - i);
            continue;
        }
        sample.first = (lower[2] * voxels[1] + lower[1]) * voxels[0] + lower[0];
        if (field.shown_cells != nullptr && field.shown_cells[sample.first] == 0) {
            continue;
        }
        for (int axis = 0; axis < 3; ++axis) {
            set_weights(place[axis], headlight.apart_xyz[axis], voxels[axis], sample.across[axis]);
        }
        float corners[8];
        const double value = read_cell(field, sample, corners);
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
        shade(field, headlight, direction, corners, sample);
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

// What a sample adds to gradient and curvature through its value, and through the values above and below along an axis.
struct Pull {
    float down;
    float bend;
};

inline void add(const Sample& sample, const Strides& next, const Pull& by_value, const Pull* by_side, float* sums) {
    for (int k = 0; k < 8; ++k) {
        const int64_t voxel =
            sample.first + (k & 1 ? next.along[0] : 0) + (k & 2 ? next.along[1] : 0) + (k & 4 ? next.along[2] : 0);
        const int at[3] = {k & 1, k >> 1 & 1, k >> 2};
        const float x = sample.across[0].between[at[0]];
        const float y = sample.across[1].between[at[1]];
        const float z = sample.across[2].between[at[2]];
        const float share = x * y * z;
        const float around[3] = {y * z, x * z, x * y};
        float down = share * by_value.down;
        float bend = share * by_value.bend;
        for (int axis = 0; axis < 3; ++axis) {
            down += around[axis] * sample.across[axis].slope[1 + at[axis]] * by_side[axis].down;
            bend += around[axis] * sample.across[axis].spread[1 + at[axis]] * by_side[axis].bend;
        }
        sums[refine_numbers * voxel] += down;
        sums[refine_numbers * voxel + 1] += bend;
    }
    for (int axis = 0; axis < 3; ++axis) {
        const int one = (axis + 1) % 3;
        const int other = (axis + 2) % 3;
        each_plane_beside(sample.across[axis], next.along[axis], [&](int64_t plane, int64_t apart) {
            const float down = sample.across[axis].slope[plane] * by_side[axis].down;
            const float bend = sample.across[axis].spread[plane] * by_side[axis].bend;
            for (int k = 0; k < 4; ++k) {
                const float weight = sample.across[one].between[k & 1] * sample.across[other].between[k >> 1];
                const int64_t voxel =
                    sample.first + apart + (k & 1 ? next.along[one] : 0) + (k >> 1 ? next.along[other] : 0);
                sums[refine_numbers * voxel] += weight * down;
                sums[refine_numbers * voxel + 1] += weight * bend;
            }
        });
    }
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
        if (bend + bend_by_shade > 0.0) {
            Pull by_side[3];
            for (int axis = 0; axis < 3; ++axis) {
                const double by = sample.shade_by[axis];
                by_side[axis] = {static_cast<float>(weight * down_by_shade * by),
                                 static_cast<float>(weight * bend_by_shade * std::abs(by))};
            }
            add(sample, next, {static_cast<float>(weight * down), static_cast<float>(weight * bend)}, by_side, sums);
        }
    });
    return cost;
}

}  // namespace

template <typename T>
void lit_light(const T* src, Shape3 shape, double scale, const Rays& rays, const Headlight& headlight,
               const SlopedTable& table, double* light, int threads) {
    const ShownBlocks blocks = find_shown_blocks(src, shape, scale, table, false, threads);
    const Field<T> field{src, shape, scale, Strides(shape), blocks, nullptr};
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
    const ShownBlocks blocks = find_shown_blocks(level, shape, 1.0, target.table, true, threads);
    const Field<float> field{level, shape, 1.0, Strides(shape), blocks, shown_cells.data()};
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
