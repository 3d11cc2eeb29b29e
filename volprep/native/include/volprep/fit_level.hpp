// A coarse level as the field between whose voxels level 0 is missed least: in its values, or in what transfer
// functions make of them. The method is volprep's own.
#pragma once

#include <cstdint>
#include <cstring>

#include "volprep/shape.hpp"

namespace volprep {

// Numbers that a transfer function makes of a value.
inline constexpr int64_t look_size = 4;

// SliceRange begin to end - 1.
struct SliceRange {
    int64_t begin;
    int64_t end;
};

// The data and the model. Values are counted in bins 0 to bins - 1. Each transfer function has a look F[bin], linear
// between bins.
struct FitTask {
    Shape3 shape;           // samples: voxels of level 0, or means of some
    int64_t first;          // number of the first slice of them, a multiple of the factor
    Shape3 factors;         // samples that make one voxel of the level
    SliceRange wanted;      // of the level
    float linear;           // weight of the square of the difference of values, in bins
    int64_t bins;           // at least 2
    int64_t functions;      // number of transfer functions, 0 or more
    const float* looks;     // [functions][bins][look_size]
    const float* weights;   // [functions][weight_shape] how much each block of samples matters
    Shape3 weight_shape;    // blocks, of the whole volume
    Shape3 weight_factors;  // samples along the edges of a block
};

// Samples that are voxels of level 0.
template <typename T>
struct Codes {
    const T* voxels;
    float bins_per_code;  // a voxel v lies at v · bins_per_code, and has the look of the nearest bin
};

// Samples that are means over some voxels of level 0 (sample_means).
struct Means {
    const float* values;  // [shape]
    const float* looks;   // [z][functions][y][x][look_size]
};

// Improves the wanted slices of `level`, float32 in bins with reduced_shape(shape, factors), `iterations` times; others
// as far as they have influence. With u the trilinear field
// of the level at a sample (outside its outer centres: their value), k = floor(u), d = F[k + 1] - F[k], v the value and
// V the look of the sample, each voxel moves by
//   step · Σ h (linear (v - u) + Σ weight d · (V - F[k] - (u - k) d)) / Σ h (linear + Σ weight d · d)
// over the samples on which it has influence h, and stays within 0 and bins - 1. Where factors.z and factors.y are 2 or
// more, a step takes the rows of samples whose z + y + steps left is odd, where z counts from the first slice of the
// volume: half of them, equally above and below a voxel. After n iterations a voxel depends on data up to n voxels of
// the level away, so that slabs with a margin of n voxels give the same level. The sums do not depend on the number of
// threads. T: uint8_t, uint16_t.
template <typename T>
void fit_level(const Codes<T>& samples, const FitTask& task, int iterations, float step, float* level,
               int threads) noexcept;
void fit_level(const Means& samples, const FitTask& task, int iterations, float step, float* level,
               int threads) noexcept;

// The four numbers that a transfer function makes of a value, as one vector: compilers have such vectors on every CPU,
// and sums are made in one order.
using LookVector = float __attribute__((vector_size(look_size * sizeof(float))));

inline LookVector load_look(const float* look) noexcept {
    LookVector vector;
    std::memcpy(&vector, look, sizeof vector);
    return vector;
}

inline void store_look(const LookVector& vector, float* look) noexcept { std::memcpy(look, &vector, sizeof vector); }

inline float dot(const LookVector& a, const LookVector& b) noexcept {
    const LookVector products = a * b;
    return (products[0] + products[2]) + (products[1] + products[3]);
}

// Means that coarse levels are fitted to, in place of every voxel: values[k] = mean of v · bins_per_code over the
// voxels v of block k, summed exactly. looks of k = mean of F[nearest bin] over the rows of block k in which z - y,
// from the block's first voxel, is a multiple of the smaller of factors.z and factors.y: each slice and each height has
// the same number of them. They are summed in float32: rows from left to right, then the rows in order of z and y. A
// block that hangs over the edge has the voxels inside. T: uint8_t, uint16_t.
template <typename T>
void sample_means(const Codes<T>& src, Shape3 shape, Shape3 factors, int64_t functions, int64_t bins,
                  const float* table, float* values, float* looks, int threads) noexcept;

// Improves `level`, float32 with reduced_shape(shape, factors), `iterations` times. With u the trilinear field
// of the level at a voxel of level 0 or a mean of some (outside its outer centres: their value) and v its value, each
// voxel of the level moves by
//   step · Σ h (v - u) / Σ h
// over the voxels on which it has influence h, and stays within 0 and `largest`. Equals fit_level without looks, in a
// quarter of the time for 2 × 2 × 2 voxels and a tenth for 4 × 4 × 4: Σ h v is the same in each iteration, and Σ h u is
// a sum over neighbours in the level. After n iterations a voxel depends on data up to n voxels of the level away, so
// that slabs of whole cells with a margin of n voxels give the same level. The sums do not depend on the number of
// threads. T: uint8_t, uint16_t, float.
template <typename T>
void fit_values(const T* src, Shape3 shape, Shape3 factors, float largest, int iterations, float step, float* level,
                int threads) noexcept;

}  // namespace volprep
