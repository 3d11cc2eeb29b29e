// The forward pass keeps the samples that show something; the backward pass takes the light behind a sample from the
// whole light. A lit sample and the six places beside it read four voxels of twelve rows, as vectors; a padding of the
// level makes every row a whole one. Rays are split into a fixed number of groups with sums of their own, so that the
// order of additions never depends on the threads.
#include "volprep/trace_rays.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "volprep/clones.hpp"
#include "volprep/padded_voxels.hpp"
#include "volprep/threads.hpp"

// In one piece with their callers, of which there is one for each kind of CPU. No vector is an argument of a call.
#pragma GCC diagnostic ignored "-Wpsabi"
#define VOLPREP_PART inline __attribute__((always_inline))

namespace volprep {
namespace {

constexpr int64_t groups = 4;
// Light from behind this changes no picture of 8 bits.
constexpr float least_transmittance = 2e-3F;
// Samples by which a ray stops short of the end of a block that shows nothing: more than is rounded away.
constexpr float skip_margin = 1e-3F;
// Four voxels of a row, four channels, or the weights of four planes of voxels.
using Four = float __attribute__((vector_size(16)));
using Eight = float __attribute__((vector_size(32)));
using FourInts = int32_t __attribute__((vector_size(16)));
using EightInts = int32_t __attribute__((vector_size(32)));
using FourBytes = uint8_t __attribute__((vector_size(4)));
using FourWords = uint16_t __attribute__((vector_size(8)));

VOLPREP_PART Four absolute(Four v) noexcept { return v < -v ? -v : v; }
VOLPREP_PART Four least(Four a, Four b) noexcept { return a < b ? a : b; }
VOLPREP_PART Four most(Four a, Four b) noexcept { return a > b ? a : b; }
VOLPREP_PART float sum(Four v) noexcept { return (v[0] + v[2]) + (v[1] + v[3]); }

template <typename Packed>
VOLPREP_PART Four converted(const void* from) noexcept {
    Packed packed;
    std::memcpy(&packed, from, sizeof packed);
    return __builtin_convertvector(packed, Four);
}

VOLPREP_PART Four load(const uint8_t* from) noexcept { return converted<FourBytes>(from); }
VOLPREP_PART Four load(const uint16_t* from) noexcept { return converted<FourWords>(from); }
VOLPREP_PART Four load(const float* from) noexcept { return converted<Four>(from); }

// exp(-depth) for a depth of 0 or more, within 2e-7: the polynomial of Cephes (S. L. Moshier). The C library's may have
// other last bits on another machine.
VOLPREP_PART float left_behind(float depth) noexcept {
    const float x = -std::min(depth, 80.0F);
    const auto halvings = static_cast<int32_t>(x * 1.44269504F - 0.5F);
    const auto n = static_cast<float>(halvings);
    const float r = (x - n * 0.693359375F) + n * 2.12194440e-4F;
    float p = 1.9875691500e-4F;
    for (const float c : {1.3981999507e-3F, 8.3334519073e-3F, 4.1665795894e-2F, 1.6666665459e-1F, 5.0000001201e-1F}) {
        p = p * r + c;
    }
    return ((p * r * r + r) + 1.0F) * std::bit_cast<float>((halvings + 127) << 23);
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
    float apart[3] = {};
    Four spacing_mm{};
    Four per_mm{};  // factor of a difference of codes to a slope of values
    float soft = 0.0F;

    Shading() = default;
    Shading(const Headlight& headlight, double scale) noexcept
        : soft(static_cast<float>(headlight.soft_per_mm * headlight.soft_per_mm)) {
        for (int axis = 0; axis < 3; ++axis) {
            const double spacing = headlight.spacing_mm_xyz[axis];
            apart[axis] = static_cast<float>(headlight.apart_xyz[axis]);
            spacing_mm[axis] = static_cast<float>(spacing);
            per_mm[axis] = static_cast<float>(scale / (2.0 * headlight.apart_xyz[axis] * spacing));
        }
    }
};

template <typename T>
struct Field {
    const T* level;  // padded
    Shape3 shape;
    Padding padding;
    float scale;
    const ShownBlocks& blocks;
    const std::vector<Entry>& entries;
    Shading shading;
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
    Four shade_by;  // change of the shade with the value above along each axis; below it is the opposite
    float depth_slope;
    float by_shade;  // the most that the shade changes
    float shown;     // opacity that is seen
    float behind;    // share of the light from behind that comes through
    Four colour;     // and 0
    Four lit;        // colour with its shade, and 1
    Four slope;      // of the lit colour, and 0
    Four by_value;   // slopes of the light's four channels by the value
};

struct Ray {
    std::vector<Sample> samples;
    Four light;
    float depth_mm;
};

// Weights of the planes by the distance of a place from plane 1.
VOLPREP_PART Four weights_at(float place) noexcept {
    return most(1.0F - absolute(place - Four{-1.0F, 0.0F, 1.0F, 2.0F}), Four{});
}

// Finds the weights beside a place that lies so far above the centre of the lower voxel of its cell.
VOLPREP_PART void look_beside(float place, float apart, int32_t lower, int64_t voxels, Across& across) noexcept {
    // Beyond the centres of the outer voxels, values are theirs.
    const Four above = weights_at(std::min(place + apart, static_cast<float>(voxels - 1 - lower)));
    const Four below = weights_at(std::max(place - apart, static_cast<float>(-lower)));
    across.slope = above - below;
    across.spread = above + below;
}

// The four rows through the cell of a sample, mixed.
template <typename T>
VOLPREP_PART Four read_cell(const Field<T>& field, const Sample& sample) noexcept {
    const auto& [x, y, z] = sample.across;
    const T* const corner = field.level + sample.first - 1;
    const int64_t next_y = field.padding.next_y;
    const int64_t next_z = field.padding.next_z;
    return z.between[1] * (y.between[1] * load(corner) + y.between[2] * load(corner + next_y)) +
           z.between[2] * (y.between[1] * load(corner + next_z) + y.between[2] * load(corner + next_z + next_y));
}

// The differences of the values beside a sample; `between` is what read_cell says.
template <typename T>
VOLPREP_PART Four read_beside(const Field<T>& field, const Sample& sample, Four between) noexcept {
    const auto& [x, y, z] = sample.across;
    const T* const corner = field.level + sample.first - 1;
    const auto row = [&](int plane_y, int plane_z) __attribute__((always_inline)) {
        return load(corner + (plane_y - 1) * field.padding.next_y + (plane_z - 1) * field.padding.next_z);
    };
    Four across_y{};
    Four across_z{};
    for (int k = 0; k < 4; ++k) {
        across_y += y.slope[k] * (z.between[1] * row(k, 1) + z.between[2] * row(k, 2));
        across_z += z.slope[k] * (y.between[1] * row(1, k) + y.between[2] * row(2, k));
    }
    return Four{sum(x.slope * between), sum(x.between * across_y), sum(x.between * across_z), 0.0F};
}

VOLPREP_PART float shade(const Shading& shading, Four along_axis, Four differences, Sample& sample) noexcept {
    const Four gradient = differences * shading.per_mm;
    const float along = sum(gradient * along_axis);
    const float squared = sum(gradient * gradient);
    // sqrt((along^2 + soft^2) / (squared + soft^2)), and how it changes with each value beside.
    const float forward = along * along + shading.soft;
    const float whole = squared + shading.soft;
    // One division, as divisions are half of the time of a shade.
    const float both = 1.0F / (forward * whole);
    const float root = std::sqrt(both);
    const float shade = forward * root;
    sample.shade_by = (root * along * along_axis - shade * (forward * both) * gradient) * shading.per_mm;
    sample.by_shade = 2.0F * sum(absolute(sample.shade_by));
    return shade;
}

// The samples of a ray, in voxels: xyz and 0.
struct March {
    Four start;
    Four stride;
    Four per_stride;  // huge where the ray does not move
    Four direction;   // of length 1
    int32_t count;
    float segment_mm;

    March(const Rays& rays, int64_t number, const Shading& shading) noexcept
        : start{},
          stride{},
          per_stride{},
          direction{},
          count(int32_t(rays.offsets[number + 1] - rays.offsets[number])) {
        const double step_mm = rays.length_mm[number] / count;
        segment_mm = static_cast<float>(step_mm);
        per_stride[3] = 1e30F;
        for (int axis = 0; axis < 3; ++axis) {
            const double along = rays.direction_xyz[3 * number + axis];
            start[axis] = static_cast<float>(rays.origin_xyz[3 * number + axis] + 0.5 * step_mm * along);
            stride[axis] = static_cast<float>(step_mm * along);
            per_stride[axis] = std::abs(stride[axis]) > 1e-12F ? 1.0F / stride[axis] : 1e30F;
            direction[axis] = static_cast<float>(along) * shading.spacing_mm[axis];
        }
    }

    // How many samples from this place on, at least 1, lie in its block of cells.
    VOLPREP_PART int32_t in_block(Four place, FourInts block) const noexcept {
        const Four begin = __builtin_convertvector(block * block_edge, Four);
        const Four end = begin + (stride < 0.0F ? Four{} : Four{} + float(block_edge));
        const Four steps = (end - place) * per_stride;
        const float fewest = std::min({steps[0], steps[1], steps[2], float(count)});
        return std::max(1, static_cast<int32_t>(std::ceil(fewest - skip_margin)));
    }
};

template <bool is_kept, bool is_lit, typename T>
VOLPREP_PART void march(const Field<T>& field, const Rays& rays, int64_t number, Ray& ray) {
    ray.samples.clear();
    const March way(rays, number, field.shading);
    const Four last{float(field.shape.x - 1), float(field.shape.y - 1), float(field.shape.z - 1), 0.0F};
    const FourInts last_cell = __builtin_convertvector(most(last - 1.0F, Four{}), FourInts);
    const auto last_entry = static_cast<int32_t>(field.entries.size()) - 1;
    const float places_per_code = field.scale * static_cast<float>(last_entry);
    const Shape3& blocks = field.blocks.shape;
    Four light{};
    float transmittance = 1.0F;
    float brightest = 0.0F;
    ray.depth_mm = 0.5F * static_cast<float>(rays.length_mm[number]);
    Sample sample;
    int32_t next = 0;
    for (int32_t i = 0; i < way.count && transmittance >= least_transmittance; i = next) {
        next = i + 1;
        // In the outer half voxels values and gradients are those of the outer voxels.
        const Four place = most(least(way.start + float(i) * way.stride, last), Four{});
        const FourInts whole = __builtin_convertvector(place, FourInts);
        const FourInts lower = whole < last_cell ? whole : last_cell;
        const FourInts block = lower / block_edge;
        if (field.blocks.shown[(block[2] * blocks.y + block[1]) * blocks.x + block[0]] == 0) {
            next = i + way.in_block(place, block);
            continue;
        }
        sample.first = field.padding.index(lower[2], lower[1], lower[0]);
        const Four above = place - __builtin_convertvector(lower, Four);
        for (int axis = 0; axis < 3; ++axis) {
            sample.across[axis].between = Four{0.0F, 1.0F - above[axis], above[axis], 0.0F};
        }
        const Four between = read_cell(field, sample);
        const float value = sum(sample.across[0].between * between);
        const float position = std::min(std::max(value * places_per_code, 0.0F), float(last_entry));
        const int32_t entry = std::min(static_cast<int32_t>(position), last_entry - 1);
        const float weight = position - static_cast<float>(entry);
        const Entry& low = field.entries[entry];
        const Entry& high = field.entries[entry + 1];
        Four rgba = low.rgba + weight * (high.rgba - low.rgba);
        const float extinction_per_mm = rgba[3];
        Four slopes = low.slopes + weight * (high.slopes - low.slopes);
        if (extinction_per_mm <= 0.0F && slopes[3] == 0.0F) {
            continue;
        }
        float shaded = 1.0F;
        if constexpr (is_lit) {
            const float* const apart = field.shading.apart;
            look_beside(above[0], apart[0], lower[0], field.shape.x, sample.across[0]);
            look_beside(above[1], apart[1], lower[1], field.shape.y, sample.across[1]);
            look_beside(above[2], apart[2], lower[2], field.shape.z, sample.across[2]);
            shaded = shade(field.shading, way.direction, read_beside(field, sample, between), sample);
        }
        const float through = left_behind(extinction_per_mm * way.segment_mm);
        sample.shown = transmittance * (1.0F - through);
        rgba[3] = 0.0F;
        sample.lit = rgba * shaded;
        sample.lit[3] = 1.0F;
        light += sample.shown * sample.lit;
        transmittance *= through;
        if constexpr (is_kept) {
            sample.colour = rgba;
            sample.behind = transmittance;
            sample.depth_slope = slopes[3] * way.segment_mm;
            slopes[3] = 0.0F;
            sample.slope = slopes * shaded;
            ray.samples.push_back(sample);
        } else if (sample.shown > brightest) {
            brightest = sample.shown;
            ray.depth_mm = (static_cast<float>(i) + 0.5F) * way.segment_mm;
        }
    }
    ray.light = light;
}

// What a sample adds to gradient and curvature, a pair of numbers: through its value, and through the values beside it
// along each axis. The weights of the values beside it are slopes for one, spreads for the other.
struct Pull {
    float down;
    float bend;
    Four down_beside;
    Four bend_beside;
};

VOLPREP_PART Eight paired(Four down, Four bend) noexcept {
    return __builtin_shufflevector(down, bend, 0, 4, 1, 5, 2, 6, 3, 7);
}

// Adds a pull to the voxels of all rows; `sums` has two numbers for each.
template <bool is_lit>
VOLPREP_PART void add_to_rows(const Sample& sample, const Padding& padding, const Pull& pull, float* sums) noexcept {
    const auto& [x, y, z] = sample.across;
    float* const corner = sums + trace_numbers * (sample.first - 1);
    const auto add = [&](int plane_y, int plane_z, Eight added) __attribute__((always_inline)) {
        float* const to = corner + trace_numbers * ((plane_y - 1) * padding.next_y + (plane_z - 1) * padding.next_z);
        Eight held;
        std::memcpy(&held, to, sizeof held);
        held += added;
        std::memcpy(to, &held, sizeof held);
    };
    Four down = pull.down * x.between;
    Four bend = pull.bend * x.between;
    if constexpr (is_lit) {
        down += pull.down_beside[0] * x.slope;
        bend += pull.bend_beside[0] * x.spread;
    }
    const Eight own = paired(down, bend);
    if constexpr (!is_lit) {
        for (int k = 1; k <= 2; ++k) {
            add(1, k, y.between[1] * z.between[k] * own);
            add(2, k, y.between[2] * z.between[k] * own);
        }
        return;
    }
    const Eight between = paired(x.between, x.between);
    const Eight by_y = paired(pull.down_beside[1] * y.slope, pull.bend_beside[1] * y.spread);
    const Eight by_z = paired(pull.down_beside[2] * z.slope, pull.bend_beside[2] * z.spread);
    // The pair of a plane, four times.
    const auto of_plane = [](Eight pairs, int plane) __attribute__((always_inline)) {
        const EightInts from = EightInts{0, 1, 0, 1, 0, 1, 0, 1} + 2 * plane;
        return __builtin_shuffle(pairs, from);
    };
    for (int k = 1; k <= 2; ++k) {
        for (int plane = 1; plane <= 2; ++plane) {
            const Eight across = of_plane(by_y, plane) * z.between[k] + y.between[plane] * of_plane(by_z, k);
            add(plane, k, y.between[plane] * z.between[k] * own + across * between);
        }
        for (const int plane : {0, 3}) {
            add(plane, k, of_plane(by_y, plane) * z.between[k] * between);
            add(k, plane, of_plane(by_z, plane) * y.between[k] * between);
        }
    }
}

// Adds what one ray says; returns its weighted squared error.
template <bool is_lit>
VOLPREP_PART double add_ray(const RayTarget& target, int64_t number, const Padding& padding, Ray& ray, float* sums) {
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
        total += absolute(sample.by_value);
        if constexpr (is_lit) {
            total += (sample.shown * sample.by_shade) * sample.colour;
        }
    }
    for (const Sample& sample : ray.samples) {
        const float shown = weight * sample.shown;
        const float by_shade = is_lit ? shown * sum(sample.colour * total) : 0.0F;
        Pull pull{weight * sum(sample.by_value * residual), weight * sum(absolute(sample.by_value) * total), {}, {}};
        if (pull.bend + by_shade <= 0.0F) {
            continue;
        }
        if constexpr (is_lit) {
            pull.down_beside = shown * sum(sample.colour * residual) * sample.shade_by;
            pull.bend_beside = by_shade * absolute(sample.shade_by);
        }
        add_to_rows<is_lit>(sample, padding, pull, sums);
    }
    return static_cast<double>(weight * sum(residual * residual));
}

template <bool is_lit, typename T>
VOLPREP_CLONES void write_light(const Field<T>& field, const Rays& rays, int64_t begin, int64_t end, double* light,
                                double* depths_mm) {
    Ray ray;
    for (int64_t number = begin; number < end; ++number) {
        march<false, is_lit>(field, rays, number, ray);
        for (int c = 0; c < 4; ++c) {
            light[4 * number + c] = static_cast<double>(ray.light[c]);
        }
        if (depths_mm != nullptr) {
            depths_mm[number] = static_cast<double>(ray.depth_mm);
        }
    }
}

// Sums of one group of rays, padded.
struct Sums {
    float* numbers;
    int64_t first;  // of the voxels at the lower corners of samples
    int64_t last = -1;
    double cost = 0.0;
};

template <bool is_lit>
VOLPREP_CLONES void add_rays(const Field<float>& field, const Rays& rays, int64_t begin, int64_t end,
                             const RayTarget& target, Sums& sums) {
    Ray ray;
    for (int64_t number = begin; number < end; ++number) {
        march<true, is_lit>(field, rays, number, ray);
        sums.cost += add_ray<is_lit>(target, number, field.padding, ray, sums.numbers);
        for (const Sample& sample : ray.samples) {
            sums.first = std::min(sums.first, sample.first);
            sums.last = std::max(sums.last, sample.first);
        }
    }
}

VOLPREP_CLONES void move_numbers(float* __restrict from, int64_t count, float* __restrict to) noexcept {
    for (int64_t i = 0; i < count; ++i) {
        to[i] += from[i];
        from[i] = 0.0F;
    }
}

Shading shading_of(const Headlight* headlight, double scale) noexcept {
    return headlight == nullptr ? Shading() : Shading(*headlight, scale);
}

}  // namespace

template <typename T>
void trace_light(const T* src, Shape3 shape, double scale, const Rays& rays, const Headlight* headlight,
                 const SlopedTable& table, double* light, double* depths_mm, int threads) {
    constexpr int64_t together = 64;
    const ShownBlocks blocks = find_shown_blocks(src, shape, ShownEntries(table, scale, false), threads);
    const Padding padding(shape);
    std::vector<T> level(static_cast<size_t>(padding.shape.voxels()));
    write_padded(src, shape, padding, level.data());
    const std::vector<Entry> entries = entries_of(table, false);
    const Field<T> field{
        level.data(), shape, padding, static_cast<float>(scale), blocks, entries, shading_of(headlight, scale)};
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(dynamic)
    for (int64_t begin = 0; begin < rays.count; begin += together) {
        const int64_t end = std::min(begin + together, rays.count);
        if (headlight != nullptr) {
            write_light<true>(field, rays, begin, end, light, depths_mm);
        } else {
            write_light<false>(field, rays, begin, end, light, depths_mm);
        }
    }
}

template void trace_light<uint8_t>(const uint8_t*, Shape3, double, const Rays&, const Headlight*, const SlopedTable&,
                                   double*, double*, int);
template void trace_light<uint16_t>(const uint16_t*, Shape3, double, const Rays&, const Headlight*, const SlopedTable&,
                                    double*, double*, int);

int64_t trace_room(Shape3 shape) noexcept { return (1 + groups * trace_numbers) * Padding(shape).shape.voxels(); }

double trace_sums(const float* level, Shape3 shape, const Rays& rays, const Headlight* headlight,
                  const RayTarget& target, float* room, float* sums, int threads) {
    const ShownBlocks blocks = find_shown_blocks(level, shape, ShownEntries(target.table, 1.0, true), threads);
    const Padding padding(shape);
    const int64_t padded_voxels = padding.shape.voxels();
    write_padded(level, shape, padding, room);
    const std::vector<Entry> entries = entries_of(target.table, true);
    const Field<float> field{room, shape, padding, 1.0F, blocks, entries, shading_of(headlight, 1.0)};
    std::vector<Sums> parts;
    for (int64_t group = 0; group < groups; ++group) {
        parts.push_back({room + (1 + group * trace_numbers) * padded_voxels, padded_voxels});
    }
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static, 1)
    for (int64_t group = 0; group < groups; ++group) {
        const int64_t begin = rays.count * group / groups;
        const int64_t end = rays.count * (group + 1) / groups;
        if (headlight != nullptr) {
            add_rays<true>(field, rays, begin, end, target, parts[group]);
        } else {
            add_rays<false>(field, rays, begin, end, target, parts[group]);
        }
    }
#pragma omp parallel for num_threads(resolve_threads(threads)) schedule(static)
    for (int64_t z = 0; z < shape.z; ++z) {
        for (const Sums& part : parts) {
            // Samples reach one plane below the lower corner of their cells, and two above it.
            if (padding.index(z + 1, 0, 0) + padding.next_z < part.first ||
                padding.index(z - 2, 0, 0) - padding.next_z > part.last) {
                continue;
            }
            for (int64_t y = 0; y < shape.y; ++y) {
                float* const from = part.numbers + trace_numbers * padding.index(z, y, 0);
                move_numbers(from, trace_numbers * shape.x, sums + trace_numbers * (z * shape.y + y) * shape.x);
            }
        }
    }
    double cost = 0.0;
    for (const Sums& part : parts) {
        cost += part.cost;
    }
    return cost;
}

}  // namespace volprep
