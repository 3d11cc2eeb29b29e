// Normals of voxels in float64: given, or the direction of the gradient of the stored values.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep::oracle {

// Where normals come from. A gradient's component is the difference of the two neighbours along its axis, or of the
// next voxel and this one, smoothed over the 3×3 voxels across with these weights; outside is the voxel at the edge,
// and the difference there is one-sided.
struct Normals {
    const float* vectors;  // [z, y, x, (x, y, z)]; null for gradients
    bool forward;
    double centre;
    double edge;
    double corner;
    double slope_scale = 0.0;  // not 0: vectors are slopes as a shader takes them, times this, as long as they are
    bool halved[3] = {false, false, false};  // slopes from half a voxel to each side: trilinear in each half of a cell

    bool any_halved() const noexcept { return halved[0] || halved[1] || halved[2]; }
};

// The 3×3×3 voxels around one, edges repeated: value(x, y, z) with offsets 0, 1, 2.
struct Neighbours {
    double values[27];

    double at(int x, int y, int z) const noexcept { return values[(z * 3 + y) * 3 + x]; }

    template <typename Voxel>
    Neighbours(const Voxel* voxels, Shape3 shape, const int64_t index_xyz[3]) noexcept {
        int64_t places[3][3];
        const int64_t counts[3] = {shape.x, shape.y, shape.z};
        for (int axis = 0; axis < 3; ++axis) {
            for (int64_t k = 0; k < 3; ++k) {
                places[axis][k] = std::clamp<int64_t>(index_xyz[axis] + k - 1, 0, counts[axis] - 1);
            }
        }
        double* value = values;
        for (const int64_t z : places[2]) {
            for (const int64_t y : places[1]) {
                for (const int64_t x : places[0]) {
                    *value++ = static_cast<double>(voxels[(z * shape.y + y) * shape.x + x]);
                }
            }
        }
    }
};

// The gradient's component along an axis, in multiples of the kernel's weight per millimetre.
inline double slope_along(const Neighbours& around, const Normals& normals, int axis, int64_t index, int64_t count,
                          double spacing_mm) noexcept {
    // Where the difference is one-sided, clamping has made it so; forward, the last voxel looks back.
    const int high = normals.forward && index == count - 1 ? 1 : 2;
    const int low = normals.forward ? high - 1 : 0;
    const double weights[3] = {normals.centre, normals.edge, normals.corner};
    double sum = 0.0;
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            const double weight = weights[(a != 1) + (b != 1)];
            if (weight == 0.0) continue;
            const auto value = [&](int along) {
                return axis == 0 ? around.at(along, a, b) : axis == 1 ? around.at(a, along, b) : around.at(a, b, along);
            };
            sum += weight * (value(high) - value(low));
        }
    }
    const bool one_sided = !normals.forward && (index == 0 || index == count - 1);
    return sum * (one_sided ? 2.0 : 1.0) / spacing_mm;
}

// Slopes of the eight voxels around a cell as a shader takes them from samples one voxel apart: beyond the last voxel
// is the last voxel, so that a difference there is half as long as one inside, or 0 where it looks forward. `index_xyz`
// has the lower and the upper voxel along each axis.
template <typename Voxel>
void corner_slopes(const Voxel* voxels, Shape3 shape, const double spacing_mm[3], const Normals& normals,
                   const int64_t index_xyz[3][2], double corners[3][8]) noexcept {
    const int64_t counts[3] = {shape.x, shape.y, shape.z};
    const int64_t strides[3] = {1, shape.x, shape.slice()};
    int64_t back[3][2];
    int64_t ahead[3][2];
    for (int axis = 0; axis < 3; ++axis) {
        for (int side = 0; side < 2; ++side) {
            const int64_t index = index_xyz[axis][side];
            back[axis][side] = normals.forward || index == 0 ? 0 : strides[axis];
            ahead[axis][side] = index == counts[axis] - 1 ? 0 : strides[axis];
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        const double scale = (normals.forward ? 1.0 : 0.5) * normals.slope_scale / spacing_mm[axis];
        for (int i = 0; i < 8; ++i) {
            const Voxel* here = voxels + index_xyz[0][i & 1] + index_xyz[1][i >> 1 & 1] * strides[1] +
                                index_xyz[2][i >> 2] * strides[2];
            const int side = i >> axis & 1;
            corners[axis][i] = scale * (static_cast<double>(here[ahead[axis][side]]) -
                                        static_cast<double>(*(here - back[axis][side])));
        }
    }
}

// The trilinear field at a place in halves of voxels, x, y, z.
template <typename Voxel>
double value_at_half(const Voxel* voxels, Shape3 shape, const int64_t place[3]) noexcept {
    const int64_t strides[3] = {1, shape.x, shape.slice()};
    int64_t low = 0;
    int64_t next[3];
    for (int axis = 0; axis < 3; ++axis) {
        low += place[axis] / 2 * strides[axis];
        next[axis] = place[axis] % 2 * strides[axis];
    }
    double sum = 0.0;
    for (int i = 0; i < 8; ++i) {
        sum += static_cast<double>(voxels[low + (i & 1) * next[0] + (i >> 1 & 1) * next[1] + (i >> 2) * next[2]]);
    }
    return 0.125 * sum;
}

// The same slopes where some axes are halved, at the eight corners of a part of a cell. `halves_xyz` has its lower and
// its upper end along each axis, in halves of voxels.
template <typename Voxel>
void corner_slopes_halved(const Voxel* voxels, Shape3 shape, const double spacing_mm[3], const Normals& normals,
                          const int64_t halves_xyz[3][2], double corners[3][8]) noexcept {
    const int64_t counts[3] = {shape.x, shape.y, shape.z};
    for (int axis = 0; axis < 3; ++axis) {
        const int64_t reach = normals.halved[axis] ? 1 : 2;
        const double scale = normals.slope_scale / (static_cast<double>(reach) * spacing_mm[axis]);
        for (int i = 0; i < 8; ++i) {
            int64_t place[3] = {halves_xyz[0][i & 1], halves_xyz[1][i >> 1 & 1], halves_xyz[2][i >> 2]};
            const int64_t centre = place[axis];
            place[axis] = std::min(centre + reach, 2 * (counts[axis] - 1));
            const double ahead = value_at_half(voxels, shape, place);
            place[axis] = std::max<int64_t>(centre - reach, 0);
            corners[axis][i] = scale * (ahead - value_at_half(voxels, shape, place));
        }
    }
}

// The normal of a voxel, where slopes are not those of a shader: a unit vector, or as it is given; 0 where there is no
// gradient.
template <typename Voxel>
void voxel_normal(const Voxel* voxels, Shape3 shape, const double spacing_mm[3], const Normals& normals,
                  const int64_t index_xyz[3], double out[3]) noexcept {
    const int64_t at = (index_xyz[2] * shape.y + index_xyz[1]) * shape.x + index_xyz[0];
    if (normals.vectors != nullptr) {
        std::copy_n(normals.vectors + 3 * at, 3, out);
        return;
    }
    const Neighbours around(voxels, shape, index_xyz);
    const int64_t counts[3] = {shape.x, shape.y, shape.z};
    double largest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        out[axis] = slope_along(around, normals, axis, index_xyz[axis], counts[axis], spacing_mm[axis]);
        largest = std::max(largest, std::fabs(out[axis]));
    }
    if (largest == 0.0) return;
    // Scaled first: squares of the smallest and the largest slopes are no numbers.
    double square = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        out[axis] /= largest;
        square += out[axis] * out[axis];
    }
    const double length = std::sqrt(square);
    for (int axis = 0; axis < 3; ++axis) out[axis] /= length;
}

}  // namespace volprep::oracle
