// Coarser levels: one voxel of each block, or of what a filter covers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "volprep/blocks.hpp"
#include "volprep/shape.hpp"
#include "volprep/taps.hpp"

namespace volprep {

// Voxels in one block above which box_reduce could lose exactness.
inline constexpr int64_t max_box_voxels = int64_t{1} << 31;

// dst[k] = mean of the factors.z × factors.y × factors.x voxels of block k. A block that hangs over the edge behaves as
// if the edge voxel were repeated. The mean is rounded once:
//   integers  summed exactly, rounded half to even;
//   float32   summed in double, each row from left to right, then the rows in order of z and y; divided by the number
//             of voxels; rounded to float32. NaN propagates, and is written as 0x7fc00000 whatever its payload was.
// factors >= 1 with a product of at most max_box_voxels; dst holds reduced_shape(shape, factors).
// T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void box_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, int threads) noexcept;

// dst[k] = voxel k · factor + factor / 2 along each axis, or the last one where that lies outside: the one that
// GL_NEAREST takes at the centre of the block. Of an even number of voxels it is the upper of the two beside the
// centre, so that the picture moves by half a voxel of src. factors >= 1; threads >= 1. T: uint8_t, int16_t, uint16_t,
// float.
template <typename T>
void nearest_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, int threads) noexcept;

// dst[k] = the median of the voxels of block k; of an even number of voxels the mean of the middle two: the lower one
// alone would darken noise. Integers: rounded half to even; float32: the mean in double, rounded. float32 is sorted in
// the order of float_order.hpp. factors >= 1 with a product of at most max_block_voxels; scratch:
// block_scratch(factors) voxels for each thread; threads >= 1. T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void median_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst, T* scratch, int threads) noexcept;

// dst[k] = the value that most voxels of block k have, the smallest of equally frequent ones. With a
// `background` its voxels do not count, and it remains only where a block has nothing else: small things do not drown.
// factors >= 1 with a product of at most max_block_voxels; scratch: block_scratch(factors) voxels for each thread;
// tallies: 65536 zeroed words for each thread, zero again afterwards; threads >= 1. T: uint8_t, int16_t, uint16_t.
template <typename T>
void mode_reduce(const T* src, Shape3 shape, Shape3 factors, std::optional<T> background, T* dst, T* scratch,
                 uint32_t* tallies, int threads) noexcept;

inline constexpr int64_t mode_tally_words = 65536;

// Voxels of a row, in whole blocks, that are folded together: scratch memory that a thread needs.
constexpr int64_t extrema_run(Shape3 factors) noexcept { return std::max<int64_t>(1, 4096 / factors.x) * factors.x; }

// dst_min[k], dst_max[k] = the least and the greatest of the voxels of block k. Either may be null: it is not written.
// float32 in the order of float_order.hpp: −0 is less than +0, and a NaN with a sign less, one without greater than
// all. factors >= 1 with a product of at most max_block_voxels; scratch: extrema_run(factors) voxels for each thread;
// threads >= 1. T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void extrema_reduce(const T* src, Shape3 shape, Shape3 factors, T* dst_min, T* dst_max, T* scratch,
                    int threads) noexcept;

// dst[k] = Σ weights · voxels / 2^n, where 2^n is the product of the sums of the weights along z, y and x. Voxels
// outside the volume are those at its edge. Rounded once:
//   integers  summed exactly, rounded half to even, clamped to what T can hold;
//   float32   in double, along z, then y, then x, each pair by pair from the outermost voxels inwards:
//             ((w0 · (v0 + v_last)) + w1 · (v1 + v_last-1)) + ...; divided; rounded to float32. NaN propagates, and is
//             written as 0x7fc00000.
// With `clamp` the result is limited to the range of the voxels that have a weight: what a filter with negative weights
// would add beyond them belongs to other materials.
// src is a slab of the volume, `place` says which. scratch: linear_reduce_scratch bytes. threads >= 1.
// T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void linear_reduce(const T* src, Shape3 shape, const SlabPlace& place, const Taps3& taps, bool clamp, T* dst,
                   int64_t slices, std::byte* scratch, int threads) noexcept;

template <typename T>
int64_t linear_reduce_scratch(Shape3 shape, const Taps3& taps, bool clamp, int threads) noexcept;

// The feature-preserving filter: a noise-gated extremum over a smooth base. Our own; no paper's formula is meant by it.

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

// A coarser level of a volume that is classified already: what light does is averaged, not colours and opacities.
// After the idea of Kraus & Bürger (Interpolating and downsampling RGBA volume data, VMV 2008); the formula is ours.

// Distances of voxel centres, in millimetres.
struct Spacing3 {
    double z;
    double y;
    double x;
};

// src is [z, y, x, 4]: linear colour, not premultiplied, and opacity over `reference_mm`; dst has the same meaning,
// with the shape reduced_shape(shape, factors). A voxel that is h long along an axis has transmittance (1 − a)^(h /
// reference). For each axis the light that crosses the block in each of its columns is integrated, and averaged over
// the columns and over both directions: transmittance T and premultiplied colour C. An axis then wants the opacity 1 −
// T^(reference / length of the block) and the colour C / (1 − T); dst is the mean over the axes, colours weighted with
// their opacities. Blocks without any opacity keep the mean of their colours. A block that hangs over the edge behaves
// as if the edge voxel were repeated. uint8_t: 255 is 1, rounded half to even. In double. factors >= 1; threads >= 1.
// T: uint8_t, float.
template <typename T>
void rgba_reduce(const T* src, Shape3 shape, Shape3 factors, const Spacing3& spacing_mm, double reference_mm, T* dst,
                 int threads) noexcept;

inline constexpr int most_coverage_samples = 8;

// dst[v] = the label of `src` that most of samples^3 evenly placed points of voxel v have, the smallest of labels that
// are equally frequent. `src_from_dst` is [3, 4], from indices (x, y, z, 1) of dst to indices of src; voxel centres are
// integers. A point that is nearest to no voxel of src has label 0. 1 <= samples <= most_coverage_samples; threads
// >= 1.
void label_coverage(const uint16_t* src, Shape3 src_shape, const double* src_from_dst, int samples, uint16_t* dst,
                    Shape3 dst_shape, int threads) noexcept;

}  // namespace volprep
