// Squared Euclidean distance of every cell to the nearest occupied one, up to a radius of 254 cells.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// The value of 255 cells and more, which a byte cannot hold.
inline constexpr uint16_t far_away = 65535;

// Numbers that one thread needs beside the result: a tile of columns along the longest axis but x, and one for each
// row.
inline constexpr int64_t euclidean_tile_width = 64;
constexpr int64_t euclidean_scratch(Shape3 shape) noexcept {
    return (shape.z > shape.y ? shape.z : shape.y) * (euclidean_tile_width + 1);
}

// dst[c] = the least dz² + dy² + dx² to a cell o with occupied[o] != 0 where it is below 255², else far_away. scratch
// holds euclidean_scratch(shape) numbers for each of the `threads` threads; threads >= 1.
void euclidean_distance(const uint8_t* occupied, Shape3 shape, uint16_t* dst, uint16_t* scratch, int threads) noexcept;

}  // namespace volprep
