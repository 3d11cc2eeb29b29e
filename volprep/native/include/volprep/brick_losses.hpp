// Loss of a picture where a brick is drawn from the next coarser level.
//
// The voxels of a brick, and the coarser level at the same places (trilinear), are composited along each axis, both
// ways: columns of light. If the light of a column changes by dC and its opacity by dA, its pixel changes by at most
// the greater of |dC| and |dC - dA|, whatever lies behind it. The loss is the root mean square of that over the columns
// and the four channels, in the direction where it is greatest. A pixel wider than a voxel is the mean of its columns.
#pragma once

#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep {

inline constexpr int loss_widths = 4;  // pixels as wide as 1, 2, 4 and 8 voxels

struct BrickNumbers {
    double loss[loss_widths];
    double
        opacity_xyz[3];  // mean opacity along an axis of the columns, the least of any look; without the layer around
    double cover;        // part of the columns in which something is seen, the least of any look and axis
};

// Bricks that follow each other along x.
template <typename T>
struct BrickRow {
    const T* voxels;  // [z][y][x] of `held`: `ghost` layers on each side, then the voxels
    Shape3 held;
    Shape3 inner;  // voxels of the level in the row, without layers around it
    int64_t size, ghost;
    const T* coarse;  // [z][y][x] of `coarse_shape`; null for the coarsest level
    Shape3 coarse_shape;
    const float* places[3];  // of inner voxels and one more on each side, along z, y and x, in voxels of `coarse`
};

struct BrickLooks {
    // [look][axis z, y, x][2][entry]: premultiplied colour and opacity of a voxel along the axis, then of the
    // part of a voxel that counts in the layer around a brick.
    const float* slabs;
    int64_t looks, entries;
    float per_code;  // entries from one code to the next
    float outside;   // weight of a column in the layer around a brick
    float spacing_mm[3];
    float soft_per_mm;  // slope in codes below which a place is hardly a surface; 0 without light
};

// Floats of working memory for a thread.
int64_t brick_scratch(int64_t size) noexcept;

// numbers[ceil(inner.x / size)]; scratch[threads * brick_scratch(size)]. The numbers do not depend on the threads.
template <typename T>
void brick_losses(const BrickRow<T>& row, const BrickLooks& looks, BrickNumbers* numbers, float* scratch,
                  int threads) noexcept;

}  // namespace volprep
