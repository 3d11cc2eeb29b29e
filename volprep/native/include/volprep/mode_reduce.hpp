// The most frequent label of each block.
#pragma once

#include <optional>

#include "volprep/blocks.hpp"

namespace volprep {

// dst[k] = the value that most voxels of block k have, the smallest of equally frequent ones. With a
// `background` its voxels do not count, and it remains only where a block has nothing else: small things do not drown.
// factors >= 1 with a product of at most max_block_voxels; scratch: block_scratch(factors) voxels for each thread;
// tallies: 65536 zeroed words for each thread, zero again afterwards; threads >= 1. T: uint8_t, int16_t, uint16_t.
template <typename T>
void mode_reduce(const T* src, Shape3 shape, Shape3 factors, std::optional<T> background, T* dst, T* scratch,
                 uint32_t* tallies, int threads) noexcept;

inline constexpr int64_t mode_tally_words = 65536;

}  // namespace volprep
