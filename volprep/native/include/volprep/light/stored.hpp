// Light that was computed once, as a package stores it: a coarse trilinear field of two numbers for each channel.
//
// The light at a place is first + share * second, where `share` is a function of the value at the place. In a wall that
// is thinner than a cell of the field, light falls with the value; so the fine field of values says where in the wall a
// place is, and the coarse field says how light depends on that. A bilateral grid (Chen, Paris, Durand, "Real-time
// edge-aware image processing with the bilateral grid", 2007) with two nodes along the axis of values.
#pragma once

#include <algorithm>
#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep::light {

// Shares 0 to 1 over ascending physical values, linear between them and constant outside.
struct ShareCurve {
    int64_t count;
    const double* values;
    const double* shares;

    double at(double value) const noexcept {
        const double* const above = std::upper_bound(values, values + count, value);
        if (above == values) return shares[0];
        if (above == values + count) return shares[count - 1];
        const int64_t i = above - values;
        const double part = (value - values[i - 1]) / (values[i] - values[i - 1]);
        return shares[i - 1] + part * (shares[i] - shares[i - 1]);
    }
};

// Where a place is between the nodes of a field: the lower node and the share of the upper one, along x, y and z.
struct FieldPlace {
    int64_t low[3];
    double share[3];
    int64_t step[3];  // 1, or 0 where the axis has one node
};

struct FieldGrid {
    Shape3 shape;
    double nodes_per_mm[3];  // x, y, z; node k is at start + k / this, so that the outer nodes lie on the box's faces
    double start_mm[3] = {0.0, 0.0, 0.0};

    int64_t count(int axis) const noexcept { return axis == 0 ? shape.x : axis == 1 ? shape.y : shape.z; }

    FieldPlace find(const double place_mm[3]) const noexcept {
        FieldPlace at{};
        for (int axis = 0; axis < 3; ++axis) {
            const double last = static_cast<double>(count(axis) - 1);
            const double inside = std::clamp((place_mm[axis] - start_mm[axis]) * nodes_per_mm[axis], 0.0, last);
            at.low[axis] = std::min(static_cast<int64_t>(inside), std::max<int64_t>(count(axis) - 2, 0));
            at.share[axis] = inside - static_cast<double>(at.low[axis]);
            at.step[axis] = count(axis) > 1 ? 1 : 0;
        }
        return at;
    }
    // Index of the node at corner 0 to 7 (x is bit 0), and its weight.
    int64_t corner(const FieldPlace& at, int which, double& weight) const noexcept {
        int64_t index[3];
        weight = 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const bool upper = (which >> axis & 1) != 0;
            index[axis] = at.low[axis] + (upper ? at.step[axis] : 0);
            weight *= upper ? at.share[axis] : 1.0 - at.share[axis];
        }
        return (index[2] * shape.y + index[1]) * shape.x + index[0];
    }
};

struct StoredLight {
    FieldGrid grid;
    int channels;         // 1: brightness; 3: linear RGB
    const float* texels;  // [z, y, x, 2, channels]: first, second
    ShareCurve curve;

    void at(const double place_mm[3], double value, double light[3]) const noexcept {
        const FieldPlace place = grid.find(place_mm);
        const double share = curve.at(value);
        double sums[3] = {0.0, 0.0, 0.0};
        for (int which = 0; which < 8; ++which) {
            double weight = 0.0;
            const float* const texel = texels + 2 * channels * grid.corner(place, which, weight);
            for (int c = 0; c < channels; ++c) {
                sums[c] += weight * (static_cast<double>(texel[c]) + share * static_cast<double>(texel[channels + c]));
            }
        }
        for (int c = 0; c < 3; ++c) light[c] = std::max(sums[channels == 1 ? 0 : c], 0.0);
    }
};

}  // namespace volprep::light
