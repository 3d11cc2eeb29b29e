// How strongly voxels differ from their neighbours: what the noise of a scan is estimated from.
#pragma once

#include <limits>

#include "volprep/shape.hpp"
#include "volprep/tally.hpp"

namespace volprep {

// |Laplacian| of a voxel: 0 to 6 times the range of its type.
template <typename T>
inline constexpr int64_t laplacian_bins =
    6 * (int64_t{std::numeric_limits<T>::max()} - std::numeric_limits<T>::lowest()) + 1;

// histogram[|L|] += 1 for every voxel that has two neighbours along every axis along which src has at least three
// voxels, where L = Σ (both neighbours − 2 · voxel) over those axes; the other axes are left out. Voxels equal to all
// their neighbours are not counted: they are padding, clipped or empty, and tell nothing about noise. Of the slices
// that have such voxels only the first counts, and every `step`-th after it. lanes: tally_words(laplacian_bins<T> + 1,
// threads) zeroed words; rows: shape.x words for each thread; threads >= 1; voxels
// <= max_tally_voxels. T: uint8_t, int16_t, uint16_t.
template <typename T>
void laplacian_histogram(const T* src, Shape3 shape, int64_t step, uint64_t* histogram, uint32_t* lanes, int32_t* rows,
                         int threads) noexcept;

}  // namespace volprep
