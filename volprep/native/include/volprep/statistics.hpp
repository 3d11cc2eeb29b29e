// Ranges and counts of voxels, and their codes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "volprep/shape.hpp"
#include "volprep/tally.hpp"

namespace volprep {

// minimum and maximum of the finite voxels, zero always as +0; (+inf, −inf) without any.
struct ValueRange {
    float minimum;
    float maximum;
    int64_t nan;
    int64_t negative_infinite;
    int64_t positive_infinite;
};

ValueRange value_range(const float* src, int64_t voxels, int threads) noexcept;

// row_low, row_high [z, y] = the least and greatest voxel of each row; column_low, column_high [z, x] = the same for
// each column of a slice. float32 is compared as in float_order.hpp: −0 is less than +0, a NaN with a sign less than
// −inf, one without greater than +inf, so that no voxel that is not finite stays hidden. T: uint8_t, int16_t, uint16_t,
// float.
template <typename T>
void slice_ranges(const T* src, Shape3 shape, T* row_low, T* row_high, T* column_low, T* column_high,
                  int threads) noexcept;

// Minimum and maximum of the field inside each block of a volume: what empty-space skipping asks of a block.

// Which samples a block answers for. Voxels are samples at cell centres, and the field is trilinear between them,
// clamped in the outer half voxel. In voxel-centre coordinates (p = texture coordinate · n − 1/2, clamped to [0, n−1])
// block b is the interval [b·B, (b+1)·B]. A sample at p in it blends voxels floor(p) and floor(p)+1, so the block needs
// voxels b·B to min((b+1)·B, n−1), both included: B+1 of them, the last shared with the next block. The block of a
// sample is min(floor(p / B), blocks−1); at p = b·B exactly either neighbour would do, for both hold that voxel. In
// millimetres from the volume's corner block b reaches from (b·B + 1/2)·h to ((b+1)·B + 1/2)·h; the first one starts at
// 0 and the last one ends at n·h.
constexpr int64_t minmax_length(int64_t voxels, int64_t block) noexcept {
    return std::max<int64_t>(1, (voxels - 1 + block - 1) / block);
}

// The shape of dst_min and dst_max: max(1, ceil((n − 1) / B)) along each axis.
constexpr Shape3 minmax_shape(Shape3 shape, int64_t block) noexcept {
    return {minmax_length(shape.z, block), minmax_length(shape.y, block), minmax_length(shape.x, block)};
}

// The largest block: a row of its voxels must fit the kernel's stack.
inline constexpr int64_t max_minmax_block = 1024;

// dst_min, dst_max = the least and greatest voxel of each block of `block`³ cells, shared voxels included, in
// minmax_shape(shape, block). A float32 block that holds a NaN gets (−inf, +inf), so that it never looks empty; −0
// counts as less than +0. 1 <= block <= max_minmax_block. T: uint8_t, int16_t, uint16_t, float.
template <typename T>
void block_minmax(const T* src, Shape3 shape, int64_t block, T* dst_min, T* dst_max, int threads) noexcept;

// How often each value of level 0 occurs where a coarser level, as a renderer sees it, has each value.
// After the conditional distributions of sparse pdf volumes (Sicat et al., 2014), for whole levels instead of voxels.

// Bins of either value: bin b holds the codes around b / 255 of the largest code.
inline constexpr int64_t joint_bins = 256;
inline constexpr int64_t joint_counts = joint_bins * joint_bins;
// Counts of a call have 32 bits.
inline constexpr int64_t max_joint_voxels = (int64_t{1} << 32) - 1;

// Slices of a volume of `depth` slices, `first` being the number of the first of them.
template <typename T>
struct Slices {
    const T* voxels;
    Shape3 shape;
    int64_t first;
    int64_t depth;
};

// counts[256·c + f] += number of voxels of src in bin f at whose centres the level is in bin c: trilinear between the
// centres of its voxels, clamped beyond the outer ones. Codes of 16 bits fall into the nearest bin, values between
// codes too, from the middle on into the upper one. `level` holds every slice of the level beside a slice of src; its
// factors are `factors`. Scratch of each thread: joint_counts of `lanes`, level.shape.x of `rows`. Integers throughout:
// the counts do not depend on threads. T: uint8_t, uint16_t.
template <typename T>
void joint_histogram(Slices<T> src, Slices<T> level, Shape3 factors, uint64_t* counts, uint32_t* lanes, int64_t* rows,
                     int threads) noexcept;

// How strongly voxels differ from their neighbours: what the noise of a scan is estimated from.

// Bins of |Laplacian|, 0 to 6 times the range of the type. One for each size up to 2047; from there on a power of two
// of sizes has 2048 or 1024 bins, each 2^e wide: bin k = 2048 · e + m begins at (2048 + m) · 2^e − 2048. A
// table of all sizes of 16 bits would not stay in the cache.
inline constexpr int32_t laplacian_steps = 2048;

// The bits of the float have exponent and mantissa side by side: those above the eleventh of the mantissa number the
// bins.
constexpr int32_t laplacian_bin(int32_t size) noexcept {
    constexpr int32_t dropped = 23 - 11;
    const auto position = std::bit_cast<int32_t>(static_cast<float>(size + laplacian_steps)) >> dropped;
    return position - (std::bit_cast<int32_t>(static_cast<float>(laplacian_steps)) >> dropped);
}

template <typename T>
inline constexpr int64_t laplacian_bins =
    laplacian_bin(6 * (int32_t{std::numeric_limits<T>::max()} - std::numeric_limits<T>::lowest())) + 1;

// histogram[bin of |L|] += 1 for every voxel that has two neighbours along every axis along which src has at least
// three voxels, where L = Σ (both neighbours − 2 · voxel) over those axes; the other axes are left out. Voxels equal to
// all their neighbours are not counted: they are padding, clipped or empty, and tell nothing about noise. lanes:
// tally_words(laplacian_bins<T> + 1, threads) zeroed words; rows: shape.x words for each thread; threads >= 1; voxels
// <= max_tally_voxels. T: uint8_t, int16_t, uint16_t.
template <typename T>
void laplacian_histogram(const T* src, Shape3 shape, uint64_t* histogram, uint32_t* lanes, int32_t* rows,
                         int threads) noexcept;

// Windowed quantisation: physical values → 8 or 16 bit codes, their histogram and the error made, in one pass.

// physical = slope · stored + intercept; a code means low + code · step, with step = (high − low) / (2^bits − 1).
// low < high; slope, intercept, high − low and (2^bits − 1) / (high − low) are finite.
struct Window {
    double slope;
    double intercept;
    double low;
    double high;
};

// Every voxel is in exactly one of the first four. The error is that of the voxels in the window. It is kept in steps,
// and its square as an integer, so that neither threads nor the cutting into slabs can change the sum; an error below
// 2^-17 step counts as none in it.
struct QuantizationLoss {
    uint64_t in_window = 0;
    uint64_t clipped_below = 0;
    uint64_t clipped_above = 0;
    uint64_t non_finite = 0;
    uint64_t squared_steps_q32 = 0;  // in 2^-32 step²: at most 2^30 a voxel, so max_tally_voxels voxels fit
    double max_steps = 0;

    // Adds the error of `times` volumes that made error `other` each.
    constexpr void add(const QuantizationLoss& other, uint64_t times = 1) noexcept {
        in_window += times * other.in_window;
        clipped_below += times * other.clipped_below;
        clipped_above += times * other.clipped_above;
        non_finite += times * other.non_finite;
        squared_steps_q32 += times * other.squared_steps_q32;
        max_steps = std::max(max_steps, other.max_steps);
    }
};

// dst[x] = round_half_even((physical − low) · ((2^bits − 1) / (high − low))), clamped to 0 … 2^bits − 1, all in double
// and in that order: the quotient first, so that a window with one unit for each step maps integers to themselves
// exactly. NaN gets the code of low, which is 0; an infinity gets the code of the end it points to.
// histogram[code] += how often it was given; it has stored_bins<Code> entries. Returns the error of these voxels.
// threads >= 1; voxels <= max_tally_voxels. Code: uint8_t, uint16_t.
//
// Integers (uint8_t, int16_t, uint16_t): table has stored_bins<T> entries, lanes has tally_words(stored_bins<T>,
// threads) zeroed ones.
template <typename T, typename Code>
QuantizationLoss quantize(const T* src, int64_t voxels, const Window& window, Code* dst, uint64_t* histogram,
                          Code* table, uint32_t* lanes, int threads) noexcept;

// float32: lanes has tally_words(stored_bins<Code>, threads) zeroed entries.
template <typename Code>
QuantizationLoss quantize(const float* src, int64_t voxels, const Window& window, Code* dst, uint64_t* histogram,
                          uint32_t* lanes, int threads) noexcept;

}  // namespace volprep
