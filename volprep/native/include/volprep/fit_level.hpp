// A coarse level as the field between whose voxels level 0 is missed least: in its values, or in what transfer
// functions make of them. The method is volprep's own.
#pragma once

#include <cstdint>

#include "volprep/shape.hpp"

namespace volprep {

// How far two values look apart, for one transfer function. Values are counted in bins 0 to bins - 1. With a feature
// vector F(bin), linear between bins, and its slopes d[k] = F[k + 1] - F[k]:
struct Appearance {
    const float* own;      // [bins] F[k] · d[k]
    const float* slope;    // [bins] d[k] · d[k]
    const float* product;  // [bins][bins] d[k] · F[v] for the bin k of the level and v of level 0
};

// What is fitted to what.
struct FitTask {
    Shape3 shape;                   // slices of level 0 that src holds
    int64_t first;                  // number of the first of them, a multiple of the factor
    Shape3 factors;                 // voxels of level 0 that make one of the level
    float bins_per_code;            // a voxel v lies at v · bins_per_code
    float linear;                   // weight of the square of the difference of values, in bins
    int64_t bins;                   // at least 2
    int64_t functions;              // number of transfer functions, 0 or more
    const Appearance* appearances;  // [functions]
    const float* weights;           // [functions][weight_shape] how much each block of level 0 matters
    Shape3 weight_shape;            // blocks, of the whole volume
    Shape3 weight_factors;          // voxels of level 0 along the edges of a block
};

// Improves `level`, float32 in bins with reduced_shape(shape, factors), `iterations` times: with u the trilinear field
// of the level at the voxels of level 0 (outside its outer centres: their value), each voxel moves by
//   step · Σ h (linear (v - u) + Σ weight (product - own - fraction · slope)) / Σ h (linear + Σ weight · slope)
// over the voxels of level 0 on which it has influence h, and stays within 0 and bins - 1. A voxel sees after n
// iterations what lies up to n voxels of the level away, so that slabs that reach so much further give the same level.
// The sums do not depend on the number of threads. T: uint8_t, uint16_t.
template <typename T>
void fit_level(const T* src, const FitTask& task, int iterations, float step, float* level, int threads) noexcept;

}  // namespace volprep
