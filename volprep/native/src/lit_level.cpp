// The forward pass keeps the samples that show something; the backward pass takes the light behind a sample from the
// whole light. A sample and the six places beside it read four voxels of twelve rows, as vectors; a padding of the
// level makes every row a whole one. Rays are split into a fixed number of groups with sums of their own, so that the
// order of additions never depends on the threads.
#include "volprep/lit_level.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "volprep/level_cells.hpp"
#include "volprep/shown_blocks.hpp"
#include "volprep/threads.hpp"

namespace volprep {
namespace {

constexpr int64_t groups = 4;
// Light from behind this changes no picture of 8 bits.
constexpr double least_transmittance = 2e-3;
// Four voxels of a row, four channels, or the weights of four planes of voxels.
using Four = float __attribute__((vector_size(16)));

inline Four absolute(Four v) noexcept { return v < -v ? -v : v; }
inline float sum(Four v) noexcept { return (v[0] + v[2]) + (v[1] + v[3]); }

using FourBytes = uint8_t __attribute__((vector_size(4)));
using FourWords = uint16_t __attribute__((vector_size(8)));

template <typename Packed>
inline Four converted(const void* from) noexcept {
    Packed packed;
    std::memcpy(&packed, from, sizeof packed);
    return __builtin_convertvector(packed, Four);
}

inline Four load(const uint8_t* from) noexcept { return converted<FourBytes>(from); }
inline Four load(const uint16_t* from) noexcept { return converted<FourWords>(from); }
inline Four load(const float* from) noexcept { return converted<Four>(from); }

inline void add_to(float* to, Four added) noexcept {
    Four held;
    std::memcpy(&held, to, sizeof held);
    held += added;
    std::memcpy(to, &held, sizeof held);
}

// A volume with one plane more before its first one, and two after its last one, along each axis.
struct Padding {
    Shape3 shape;
    int64_t next_y;
    int64_t next_z;

    explicit Padding(Shape3 inside) noexcept
        : shape{inside.z + 3, inside.y + 3, inside.x + 3}, next_y(shape.x), next_z(shape.slice()) {}

    int64_t index(int64_t z, int64_t y, int64_t x) const noexcept {
        return (z + 1) * next_z + (y + 1) * next_y + x + 1;
    }
};

template <typename T>
std::vector<T> padded(const T* src, Shape3 shape, const Padding& padding) {
    std::vector<T> result(static_cast<size_t>(padding.shape.voxels()));
    for (int64_t z = 0; z < shape.z; ++z) {
        for (int64_t y = 0; y < shape.y; ++y) {
            std::copy_n(src + (z * shape.y + y) * shape.x, shape.x, result.data() + padding.index(z, y, 0));
        }
    }
    return result;
}

// A row of a table: linear colour, 1 for opacity, and their slopes; the slope of the extinction is the last one.
struct Entry {
    Four rgba;
    Four slopes;
};

std::vector<Entry> entries_of(const SlopedTable& table, bool is_kept) {
    std::vector<Entry> rows(static_cast<size_t>(table.entries));
    for (int64_t entry = 0; entry < table.entries; ++entry) {
        for (int c = 0; c < 4; ++c) {
            rows[entry].rgba[c] = static_cast<float>(table.rgba[4 * entry + c]);
            rows[entry].slopes[c] = is_kept ? static_cast<float>(table.slopes[4 * entry + c]) : 0.0F;
        }
    }
    return rows;
}

// How the samples of rays through a volume are lit, in the units of its codes.
struct Shading {
    const double* apart_xyz;
    double spacing_mm_xyz[3];
    float per_mm[3];  // factor of a difference of codes to a slope of values
    float soft;

    Shading(const Headlight& headlight, double scale) noexcept
        : apart_xyz(headlight.apart_xyz), soft(static_cast<float>(headlight.soft_per_mm * headlight.soft_per_mm)) {
        for (int axis = 0; axis < 3; ++axis) {
            spacing_mm_xyz[axis] = headlight.spacing_mm_xyz[axis];
            per_mm[axis] = static_cast<float>(scale / (2.0 * apart_xyz[axis] * spacing_mm_xyz[axis]));
        }
    }
};

template <typename T>
struct Field {
    const T* level;  // padded
    Shape3 shape;
    Padding padding;
    double scale;
    const ShownBlocks& blocks;
    const uint8_t* shown_cells;  // null if every cell of a block that shows something is read
    const std::vector<Entry>& entries;
};

// Weights of the planes of voxels around a sample along one axis; the sample lies between the planes 1 and 2.
struct Across {
    Four between;  // at the sample
    Four slope;    // of the value above less that below
    Four spread;   // of their sum
};

struct Sample {
    int64_t first;  // the lower corner of its cell, padded
    Across across[3];
    float shade_by[3];  // change of the shade with the value above along each axis; below it is the opposite
    float depth_slope;
    float by_shade;  // the most that the shade changes
    float shown;     // opacity that is seen
    Four colour;     // and 0
    Four lit;        // colour with its shade, and 1
    Four slope;      // of the lit colour, and 0
    Four by_value;   // slopes of the light's four channels by the value
    float behind;    // share of the light from behind that comes through
};

struct Ray {
    std::vector<Sample> samples;
    Four light;
};

// Weights of the planes by the distance of a place from plane 1.
inline Four weights_at(float place) noexcept {
    const Four weight = 1.0F - absolute(place - Four{-1.0F, 0.0F, 1.0F, 2.0F});
    return weight > 0.0F ? weight : Four{};
}

// The weights of a place that lies so far above the centre of the lower voxel of its cell.
inline Across across_at(float place, double apart, int64_t lower, int64_t voxels) noexcept {
    // Beyond the centres of the outer voxels, values are theirs.
    const auto first = static_cast<float>(-lower);
    const auto last = static_cast<float>(voxels - 1 - lower);
    const Four above = weights_at(std::min(place + static_cast<float>(apart), last));
    const Four below = weights_at(std::max(place - static_cast<float>(apart), first));
    return {weights_at(place), above - below, above + below};
}

// What the rows of voxels around a sample say: its value, and the differences of the values beside it.
struct Read {
    float value;
    float differences[3];
};

template <typename T>
inline Read read_rows(const Field<T>& field, const Sample& sample) noexcept {
    const auto& [x, y, z] = sample.across;
    const int64_t next_y = field.padding.next_y;
    const int64_t next_z = field.padding.next_z;
    const T* const corner = field.level + sample.first - 1;
    const auto row = [&](int plane_y, int plane_z) {
        return load(corner + (plane_y - 1) * next_y + (plane_z - 1) * next_z);
    };
    Four between{};
    Four across_y{};
    Four across_z{};
    for (int k = 1; k <= 2; ++k) {
        const Four near = row(1, k);
        const Four far = row(2, k);
        between += z.between[k] * (y.between[1] * near + y.between[2] * far);
        across_y +=
            z.between[k] * ((y.slope[0] * row(0, k) + y.slope[1] * near) + (y.slope[2] * far + y.slope[3] * row(3, k)));
        across_z += z.slope[k] * (y.between[1] * near + y.between[2] * far);
    }
    for (const int k : {0, 3}) {
        across_z += z.slope[k] * (y.between[1] * row(1, k) + y.between[2] * row(2, k));
    }
    return {sum(x.between * between), {sum(x.slope * between), sum(x.between * across_y), sum(x.between * across_z)}};
}

inline float shade(const Shading& shading, const double* direction, const Read& read, Sample& sample) noexcept {
    float gradient[3];
    float along_axis[3];
    float along = 0.0F;
    float squared = 0.0F;
    for (int axis = 0; axis < 3; ++axis) {
        gradient[axis] = read.differences[axis] * shading.per_mm[axis];
        along_axis[axis] = static_cast<float>(direction[axis] * shading.spacing_mm_xyz[axis]);
        along += gradient[axis] * along_axis[axis];
        squared += gradient[axis] * gradient[axis];
    }
    // sqrt((along^2 + soft^2) / (squared + soft^2)), and how it changes with each value beside.
    const float forward = along * along + shading.soft;
    const float whole = squared + shading.soft;
    const float shade = std::sqrt(forward / whole);
    const float by_along = shade * along / forward;
    const float by_squared = shade / whole;
    sample.by_shade = 0.0F;
    for (int axis = 0; axis < 3; ++axis) {
        sample.shade_by[axis] = (by_along * along_axis[axis] - by_squared * gradient[axis]) * shading.per_mm[axis];
        sample.by_shade += 2.0F * std::abs(sample.shade_by[axis]);
    }
    return shade;
}

template <bool is_kept, typename T>
void march(const Field<T>& field, const Rays& rays, int64_t number, const Shading& shading, Ray& ray) {
    ray.samples.clear();
    Four light{};
    double transmittance = 1.0;
    const int64_t count = rays.offsets[number + 1] - rays.offsets[number];
    const double segment_mm = rays.length_mm[number] / static_cast<double>(count);
    const double* const origin = rays.origin_xyz + 3 * number;
    const double* const direction = rays.direction_xyz + 3 * number;
    const double stride[3] = {direction[0] * segment_mm, direction[1] * segment_mm, direction[2] * segment_mm};
    const int64_t voxels[3] = {field.shape.x, field.shape.y, field.shape.z};
    const auto last_entry = static_cast<int64_t>(field.entries.size()) - 1;
    Sample sample;
    int64_t next = 0;
    for (int64_t i = 0; i < count && transmittance >= least_transmittance; i = next) {
        next = i + 1;
        const double along_mm = (static_cast<double>(i) + 0.5) * segment_mm;
        // In the outer half voxels values and gradients are those of the outer voxels.
        double place[3];
        Place in_cell[3];
        int64_t block[3];
        for (int axis = 0; axis < 3; ++axis) {
            place[axis] =
                std::clamp(origin[axis] + along_mm * direction[axis], 0.0, static_cast<double>(voxels[axis] - 1));
            in_cell[axis] = find_place(place[axis], voxels[axis]);
            block[axis] = in_cell[axis].lower / block_edge;
        }
        const Shape3& blocks = field.blocks.shape;
        if (field.blocks.shown[(block[2] * blocks.y + block[1]) * blocks.x + block[0]] == 0) {
            next = i + samples_in_block(place, stride, block, count - i);
            continue;
        }
        const auto [x, y, z] = in_cell;
        if (field.shown_cells != nullptr &&
            field.shown_cells[(z.lower * voxels[1] + y.lower) * voxels[0] + x.lower] == 0) {
            continue;
        }
        sample.first = field.padding.index(z.lower, y.lower, x.lower);
        for (int axis = 0; axis < 3; ++axis) {
            const Place& at = in_cell[axis];
            sample.across[axis] = across_at(at.upper_weight, shading.apart_xyz[axis], at.lower, voxels[axis]);
        }
        const Read read = read_rows(field, sample);
        const double position =
            std::clamp(static_cast<double>(read.value) * field.scale, 0.0, 1.0) * static_cast<double>(last_entry);
        const int64_t entry = std::min(static_cast<int64_t>(position), last_entry - 1);
        const auto weight = static_cast<float>(position - static_cast<double>(entry));
        const Entry& low = field.entries[entry];
        const Entry& high = field.entries[entry + 1];
        Four rgba = low.rgba + weight * (high.rgba - low.rgba);
        const float extinction_per_mm = rgba[3];
        Four slopes = low.slopes + weight * (high.slopes - low.slopes);
        if (extinction_per_mm <= 0.0F && slopes[3] == 0.0F) {
            continue;
        }
        const float shaded = shade(shading, direction, read, sample);
        const double through = std::exp(-static_cast<double>(extinction_per_mm) * segment_mm);
        sample.shown = static_cast<float>(transmittance * (1.0 - through));
        rgba[3] = 0.0F;
        sample.lit = rgba * shaded;
        sample.lit[3] = 1.0F;
        light += sample.shown * sample.lit;
        transmittance *= through;
        if constexpr (is_kept) {
            sample.colour = rgba;
            sample.behind = static_cast<float>(transmittance);
            sample.depth_slope = slopes[3] * static_cast<float>(segment_mm);
            slopes[3] = 0.0F;
            sample.slope = slopes * shaded;
            ray.samples.push_back(sample);
        }
    }
    ray.light = light;
}

// What a sample adds to gradient or curvature: through its value, and through the values beside it along each axis.
struct Pull {
    float by_value;
    float by_side[3];
};

// Adds a pull to the voxels of all rows, with the weights of the values beside a sample that `beside` names.
inline void add_to_rows(const Sample& sample, const Padding& padding, const Pull& pull, Four Across::* beside,
                        float* sums) noexcept {
    const auto& [x, y, z] = sample.across;
    float* const corner = sums + sample.first - 1;
    const auto add = [&](int plane_y, int plane_z, Four added) {
        add_to(corner + (plane_y - 1) * padding.next_y + (plane_z - 1) * padding.next_z, added);
    };
    const Four own = pull.by_value * x.between + pull.by_side[0] * x.*beside;
    const Four by_y = pull.by_side[1] * y.*beside;
    const Four by_z = pull.by_side[2] * z.*beside;
    for (int k = 1; k <= 2; ++k) {
        for (int plane = 1; plane <= 2; ++plane) {
            const float across = by_y[plane] * z.between[k] + y.between[plane] * by_z[k];
            add(plane, k, y.between[plane] * z.between[k] * own + across * x.between);
        }
        for (const int plane : {0, 3}) {
            add(plane, k, by_y[plane] * z.between[k] * x.between);
            add(k, plane, by_z[plane] * y.between[k] * x.between);
        }
    }
}

// Sums of one group of rays, padded.
struct Sums {
    std::vector<float> gradient;
    std::vector<float> curvature;
};

// Adds what one ray says; returns its weighted squared error.
double add_ray(const RefineTarget& target, int64_t number, const Padding& padding, Ray& ray, Sums& sums) {
    const auto weight = static_cast<float>(target.weight[number]);
    Four residual;
    for (int c = 0; c < 4; ++c) {
        residual[c] = static_cast<float>(static_cast<double>(ray.light[c]) - target.light[4 * number + c]);
    }
    Four total{};
    Four so_far{};
    for (Sample& sample : ray.samples) {
        so_far += sample.shown * sample.lit;
        const Four behind = ray.light - so_far;
        sample.by_value = sample.slope * sample.shown + sample.depth_slope * (sample.behind * sample.lit - behind);
        total += absolute(sample.by_value) + (sample.shown * sample.by_shade) * sample.colour;
    }
    for (const Sample& sample : ray.samples) {
        const float shown = weight * sample.shown;
        const float down_by_shade = shown * sum(sample.colour * residual);
        const float bend_by_shade = shown * sum(sample.colour * total);
        Pull down{weight * sum(sample.by_value * residual), {}};
        Pull bend{weight * sum(absolute(sample.by_value) * total), {}};
        if (bend.by_value + bend_by_shade <= 0.0F) {
            continue;
        }
        for (int axis = 0; axis < 3; ++axis) {
            down.by_side[axis] = down_by_shade * sample.shade_by[axis];
            bend.by_side[axis] = bend_by_shade * std::abs(sample.shade_by[axis]);
        }
        add_to_rows(sample, padding, down, &Across::slope, sums.gradient.data());
        add_to_rows(sample, padding, bend, &Across::spread, sums.curvature.data());
    }
    return static_cast<double>(weight * sum(residual * residual));
}

}  // namespace

template <typename T>
void lit_light(const T* src, Shape3 shape, double scale, const Rays& rays, const Headlight& headlight,
               const SlopedTable& table, double* light, int threads) {
    const ShownBlocks blocks = find_shown_blocks(src, shape, scale, table, false, threads);
    const Padding padding(shape);
    const std::vector<T> level = padded(src, shape, padding);
    const std::vector<Entry> entries = entries_of(table, false);
    const Field<T> field{level.data(), shape, padding, scale, blocks, nullptr, entries};
    const Shading shading(headlight, scale);
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic, 64)
    for (int64_t number = 0; number < rays.count; ++number) {
        Ray ray;
        march<false>(field, rays, number, shading, ray);
        for (int c = 0; c < 4; ++c) {
            light[4 * number + c] = static_cast<double>(ray.light[c]);
        }
    }
}

template void lit_light<uint8_t>(const uint8_t*, Shape3, double, const Rays&, const Headlight&, const SlopedTable&,
                                 double*, int);
template void lit_light<uint16_t>(const uint16_t*, Shape3, double, const Rays&, const Headlight&, const SlopedTable&,
                                  double*, int);

double lit_sums(const float* level, Shape3 shape, const Rays& rays, const Headlight& headlight,
                const RefineTarget& target, float* sums, int threads) {
    const std::vector<uint8_t> shown_cells = find_shown_cells(level, shape, target.table);
    const ShownBlocks blocks = find_shown_blocks(level, shape, 1.0, target.table, true, threads);
    const Padding padding(shape);
    const std::vector<float> voxels = padded(level, shape, padding);
    const std::vector<Entry> entries = entries_of(target.table, true);
    const Field<float> field{voxels.data(), shape, padding, 1.0, blocks, shown_cells.data(), entries};
    const Shading shading(headlight, 1.0);
    double costs[groups] = {};
    std::vector<Ray> work(groups);
    std::vector<Sums> parts(groups);
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static, 1)
    for (int64_t group = 0; group < groups; ++group) {
        Sums& part = parts[group];
        part.gradient.resize(voxels.size());
        part.curvature.resize(voxels.size());
        for (int64_t number = group; number < rays.count; number += groups) {
            march<true>(field, rays, number, shading, work[group]);
            costs[group] += add_ray(target, number, padding, work[group], part);
        }
    }
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t z = 0; z < shape.z; ++z) {
        for (int64_t y = 0; y < shape.y; ++y) {
            float* to = sums + refine_numbers * (z * shape.y + y) * shape.x;
            for (int64_t from = padding.index(z, y, 0); from < padding.index(z, y, shape.x); ++from) {
                for (const Sums& part : parts) {
                    to[0] += part.gradient[from];
                    to[1] += part.curvature[from];
                }
                to += refine_numbers;
            }
        }
    }
    return ((costs[0] + costs[1]) + costs[2]) + costs[3];
}

}  // namespace volprep
