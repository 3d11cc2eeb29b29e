// The machine's memory bandwidth, against which kernels are measured: the plainest loops that touch every byte.
#pragma once

#include <cstdint>

namespace volprep {

// Reads `words` words and returns their sum, so that no read can be left out.
uint64_t memory_read(const uint64_t* src, int64_t words, int threads) noexcept;

// Copies `bytes` bytes, each thread one contiguous part with memcpy.
void memory_copy(const uint8_t* src, int64_t bytes, uint8_t* dst, int threads) noexcept;

}  // namespace volprep
