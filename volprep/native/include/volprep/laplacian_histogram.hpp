// How strongly voxels differ from their neighbours: what the noise of a scan is estimated from.
#pragma once

#include <bit>
#include <limits>

#include "volprep/shape.hpp"
#include "volprep/tally.hpp"

namespace volprep {

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

}  // namespace volprep
