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

    // `value_of` turns a stored value into the number whose gradient counts.
    template <typename Voxel, typename ValueOf>
    Neighbours(const Voxel* voxels, Shape3 shape, const int64_t index_xyz[3], ValueOf&& value_of) noexcept {
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
                    *value++ = value_of(voxels[(z * shape.y + y) * shape.x + x]);
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

// Values [z][y][x] of the trilinear field at four ascending places along each axis, in halves of voxels, which span
// four voxels at most. One axis after the other: a place between two voxels has their mean.
template <typename Voxel>
void values_at_halves(const Voxel* voxels, Shape3 shape, const int64_t places_xyz[3][4],
                      double values[4][4][4]) noexcept {
    int64_t first[3];
    int64_t low[3][4];
    int64_t high[3][4];
    for (int axis = 0; axis < 3; ++axis) {
        first[axis] = places_xyz[axis][0] / 2;
        for (int i = 0; i < 4; ++i) {
            low[axis][i] = places_xyz[axis][i] / 2 - first[axis];
            high[axis][i] = (places_xyz[axis][i] + 1) / 2 - first[axis];
        }
    }
    double by_x[4][4][4];
    double by_y[4][4][4];
    for (int64_t z = 0; z <= high[2][3]; ++z) {
        for (int64_t y = 0; y <= high[1][3]; ++y) {
            const Voxel* row = voxels + ((first[2] + z) * shape.y + first[1] + y) * shape.x + first[0];
            for (int x = 0; x < 4; ++x) {
                by_x[z][y][x] = 0.5 * (static_cast<double>(row[low[0][x]]) + static_cast<double>(row[high[0][x]]));
            }
        }
        for (int y = 0; y < 4; ++y) {
            for (int x = 0; x < 4; ++x) by_y[z][y][x] = 0.5 * (by_x[z][low[1][y]][x] + by_x[z][high[1][y]][x]);
        }
    }
    for (int z = 0; z < 4; ++z) {
        for (int y = 0; y < 4; ++y) {
            for (int x = 0; x < 4; ++x) values[z][y][x] = 0.5 * (by_y[low[2][z]][y][x] + by_y[high[2][z]][y][x]);
        }
    }
}

// The same slopes where some axes are halved, at the eight corners of a part of a cell. `halves_xyz` has its lower and
// its upper end along each axis, in halves of voxels: as far apart as differences reach, or the same in the outer half
// voxel.
template <typename Voxel>
void corner_slopes_halved(const Voxel* voxels, Shape3 shape, const double spacing_mm[3], const Normals& normals,
                          const int64_t halves_xyz[3][2], double corners[3][8]) noexcept {
    const int64_t counts[3] = {shape.x, shape.y, shape.z};
    int64_t places[3][4];
    int ahead[3][2];
    int back[3][2];
    double scale[3];
    for (int axis = 0; axis < 3; ++axis) {
        const auto [low, high] = halves_xyz[axis];
        const int64_t reach = normals.halved[axis] ? 1 : 2;
        places[axis][0] = std::max<int64_t>(low - reach, 0);
        places[axis][1] = low;
        places[axis][2] = high;
        places[axis][3] = std::min(high + reach, 2 * (counts[axis] - 1));
        ahead[axis][0] = low == high ? 3 : 2;
        ahead[axis][1] = 3;
        back[axis][0] = 0;
        back[axis][1] = low == high ? 0 : 1;
        scale[axis] = normals.slope_scale / (static_cast<double>(reach) * spacing_mm[axis]);
    }
    double values[4][4][4];
    values_at_halves(voxels, shape, places, values);
    for (int i = 0; i < 8; ++i) {
        const int side[3] = {i & 1, i >> 1 & 1, i >> 2};
        const auto value_at = [&](int axis, int place) {
            return values[axis == 2 ? place : 1 + side[2]][axis == 1 ? place : 1 + side[1]]
                         [axis == 0 ? place : 1 + side[0]];
        };
        for (int axis = 0; axis < 3; ++axis) {
            corners[axis][i] =
                scale[axis] * (value_at(axis, ahead[axis][side[axis]]) - value_at(axis, back[axis][side[axis]]));
        }
    }
}

// The normal of a voxel, where slopes are not those of a shader: a unit vector, or as it is given; 0 where there is no
// gradient of `value_of`.
template <typename Voxel, typename ValueOf>
void voxel_normal(const Voxel* voxels, Shape3 shape, const double spacing_mm[3], const Normals& normals,
                  const int64_t index_xyz[3], ValueOf&& value_of, double out[3]) noexcept {
    const int64_t at = (index_xyz[2] * shape.y + index_xyz[1]) * shape.x + index_xyz[0];
    if (normals.vectors != nullptr) {
        std::copy_n(normals.vectors + 3 * at, 3, out);
        return;
    }
    const Neighbours around(voxels, shape, index_xyz, value_of);
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
