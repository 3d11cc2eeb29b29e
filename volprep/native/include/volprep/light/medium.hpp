// The medium: the trilinear field of a volume and a piecewise linear transfer function, with the
// greatest extinction of each block of cells.
//
// Places are index coordinates: the centre of voxel k is at k, and the box begins at -1/2. In the half voxel outside
// the outer centres the field is that of the nearest centre plane.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "volprep/oracle/planes.hpp"
#include "volprep/oracle/transfer.hpp"
#include "volprep/shape.hpp"
#include "volprep/statistics.hpp"

namespace volprep::light {

// Cells along an edge of a block with one majorant.
inline constexpr int64_t kBlock = 4;

// Margin of bounds, as a part of a value or of a range of values; larger than rounding errors.
inline constexpr double kSlack = 1e-9;

// Control points in ascending order; equal neighbours make a jump, and the value itself belongs to the side above.
struct Function {
    int64_t count;
    const double* values;
    const double* colours;             // [count, 3]
    const double* extinctions_per_mm;  // [count]; above 1e9 counts as 1e9
    const double* albedos;             // [count, 3], 0 to 1: what a later collision keeps of the light

    double point_extinction(int64_t i) const noexcept { return std::min(extinctions_per_mm[i], oracle::kOpaquePerMm); }

    // The first control point above a value, and the share of it in the mean of it and the one before.
    struct Between {
        int64_t above;
        double share;
    };
    Between find(double value) const noexcept {
        int64_t above = 0;
        while (above < count && values[above] <= value) ++above;
        if (above == 0 || above == count) return {above, 0.0};
        return {above, (value - values[above - 1]) / (values[above] - values[above - 1])};
    }
    double extinction(double value) const noexcept {
        const Between at = find(value);
        if (at.above == 0) return point_extinction(0);
        const double low = point_extinction(at.above - 1);
        return at.above == count ? low : low + at.share * (point_extinction(at.above) - low);
    }
    void blend(const double* triples, double value, double out[3]) const noexcept {
        const Between at = find(value);
        const int64_t low = std::max<int64_t>(at.above - 1, 0);
        const int64_t high = std::min(at.above, count - 1);
        for (int c = 0; c < 3; ++c) {
            out[c] = triples[3 * low + c] + at.share * (triples[3 * high + c] - triples[3 * low + c]);
        }
    }
    // No value in [low, high] has more extinction.
    double most_between(double low, double high) const noexcept {
        double most = std::max(extinction(low), extinction(high));
        for (int64_t i = 0; i < count; ++i) {
            if (values[i] >= low && values[i] <= high) most = std::max(most, point_extinction(i));
        }
        return most;
    }
};

template <typename Voxel>
struct Medium {
    const Voxel* voxels;
    Shape3 shape;
    double slope;  // physical = slope * stored + intercept
    double intercept;
    double spacing_mm[3];  // x, y, z
    double end[3];         // the box's far corner in index coordinates
    oracle::Planes cut;    // the medium ends at these
    const Function* function;
    Shape3 blocks;
    std::vector<double> majorants;   // [blocks]
    std::vector<double> variations;  // [blocks]: greatest minus least value

    int64_t count(int axis) const noexcept { return axis == 0 ? shape.x : axis == 1 ? shape.y : shape.z; }
    int64_t block_count(int axis) const noexcept { return axis == 0 ? blocks.x : axis == 1 ? blocks.y : blocks.z; }

    void millimetres(const double place[3], double out[3]) const noexcept {
        for (int axis = 0; axis < 3; ++axis) out[axis] = (place[axis] + 0.5) * spacing_mm[axis];
    }
    // Part of a way of `reach_mm` from a place inside that is inside.
    double inside_mm(const double place[3], const double direction[3], double reach_mm) const noexcept {
        if (cut.count == 0) return reach_mm;
        double at_mm[3];
        millimetres(place, at_mm);
        double from_mm = 0.0;
        cut.clip(at_mm, direction, from_mm, reach_mm);
        return std::max(reach_mm, 0.0);
    }
    // Least and greatest value of the voxels around a straight way: no value on it lies outside.
    void bound(const double from[3], const double to[3], double& least, double& greatest) const noexcept {
        int64_t first[3];
        int64_t last[3];
        for (int axis = 0; axis < 3; ++axis) {
            const double end_at = static_cast<double>(count(axis) - 1);
            first[axis] = static_cast<int64_t>(std::clamp(std::min(from[axis], to[axis]) - kSlack, 0.0, end_at));
            const double high = std::clamp(std::max(from[axis], to[axis]) + kSlack, 0.0, end_at);
            last[axis] = static_cast<int64_t>(std::ceil(high));
        }
        Voxel low = voxels[first[2] * shape.slice() + first[1] * shape.x + first[0]];
        Voxel high = low;
        for (int64_t z = first[2]; z <= last[2]; ++z) {
            for (int64_t y = first[1]; y <= last[1]; ++y) {
                const Voxel* const row = voxels + z * shape.slice() + y * shape.x;
                for (int64_t x = first[0]; x <= last[0]; ++x) {
                    low = std::min(low, row[x]);
                    high = std::max(high, row[x]);
                }
            }
        }
        const double one = slope * static_cast<double>(low) + intercept;
        const double other = slope * static_cast<double>(high) + intercept;
        least = std::min(one, other);
        greatest = std::max(one, other);
    }
    double value_at(const double place[3]) const noexcept {
        int64_t low[3];
        int64_t step[3];
        double share[3];
        const int64_t strides[3] = {1, shape.x, shape.slice()};
        for (int axis = 0; axis < 3; ++axis) {
            const double last = static_cast<double>(count(axis) - 1);
            const double inside = std::clamp(place[axis], 0.0, last);
            low[axis] = std::min(static_cast<int64_t>(inside), std::max<int64_t>(count(axis) - 2, 0));
            share[axis] = inside - static_cast<double>(low[axis]);
            step[axis] = count(axis) > 1 ? strides[axis] : 0;
        }
        const Voxel* const corner = voxels + low[2] * strides[2] + low[1] * strides[1] + low[0];
        const auto along = [](double a, double b, double s) { return a + s * (b - a); };
        const auto row = [&](int64_t at) {
            return along(static_cast<double>(corner[at]), static_cast<double>(corner[at + step[0]]), share[0]);
        };
        const double near = along(row(0), row(step[1]), share[1]);
        const double far = along(row(step[2]), row(step[2] + step[1]), share[1]);
        return slope * along(near, far, share[2]) + intercept;
    }
};

// Finds majorants and variations. They hold for every place of a block, rounding included.
template <typename Voxel>
void bound_blocks(Medium<Voxel>& medium, int threads) {
    const std::size_t count = static_cast<std::size_t>(medium.blocks.voxels());
    std::vector<Voxel> least(count);
    std::vector<Voxel> most(count);
    block_minmax(medium.voxels, medium.shape, kBlock, least.data(), most.data(), threads);
    medium.majorants.resize(count);
    medium.variations.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double one = medium.slope * static_cast<double>(least[i]) + medium.intercept;
        const double other = medium.slope * static_cast<double>(most[i]) + medium.intercept;
        const double low = std::min(one, other);
        const double high = std::max(one, other);
        const double slack = kSlack * (high - low) + 1e-12 * std::max(std::fabs(low), std::fabs(high));
        medium.majorants[i] = medium.function->most_between(low - slack, high + slack);
        medium.variations[i] = high - low;
    }
}

}  // namespace volprep::light
