// Windowed quantisation: physical values → 8 or 16 bit codes, their histogram and the error made, in one pass.
#pragma once

#include <algorithm>

#include "volprep/tally.hpp"

namespace volprep {

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
