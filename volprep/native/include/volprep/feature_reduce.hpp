// The feature-preserving filter: a noise-gated extremum over a smooth base. Our own; no paper's formula is meant by it.
#pragma once

#include <cstddef>

#include "volprep/shape.hpp"
#include "volprep/taps.hpp"

namespace volprep {

// When a deviation from the base is a feature: not below `low` times the noise, wholly above `high` times.
struct Gate {
    double noise;  // standard deviation, in units of the voxels; 0: every deviation is a feature
    double low;
    double high;
};

// For each cell: g = the linear filter `taps` there, unrounded (see linear_reduce); v = the least or the greatest voxel
// of the cell, whichever is farther from g, the greatest if both are as far; s = |v − g| / noise; t = (s − low) / (high
// − low), limited to 0 ... 1;
//     dst = g + t² (3 − 2t) · (v − g), rounded once, half to even. In double; of bytes in float where it holds every
//     sum (sizes of the weights: along z times along y <= 128, along x <= 200).
// So a level is smooth where the scan is smooth or noisy, and keeps what stands out: thin, bright or dark. Extrema and
// base both come from level 0: a coarser level does not inherit what a finer one decided.
// The result lies between the extremes of the filter's support, if no weight is negative. NaN propagates.
// src, place, taps, scratch, threads, T: as in linear_reduce.
template <typename T>
void feature_reduce(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, const Gate& gate, T* dst,
                    int64_t slices, std::byte* scratch, int threads) noexcept;

template <typename T>
int64_t feature_reduce_scratch(Shape3 shape, const Taps3& taps, int threads) noexcept;

}  // namespace volprep
