// Distance of every cell to the nearest occupied one: how far a ray may go without looking.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// dst[c] = the least max(|dz|, |dy|, |dx|) to a cell o with occupied[o] != 0, at most 255; 255 everywhere if there is
// none. So all cells nearer to c than dst[c], in all directions, are empty; everything outside the volume counts
// as empty. dst may not overlap occupied.
void chebyshev_distance(const uint8_t* occupied, Shape3 shape, uint8_t* dst, int threads) noexcept;

// The same for each octant of directions: dst holds 8 volumes, one after the other. Octant k looks towards smaller x if
// k & 1, smaller y if k & 2, smaller z if k & 4, else towards greater; in it dst[c] is the edge of the largest cube of
// empty cells with c as the corner that the others are ahead of, at most 255, 0 where c itself is occupied.
void octant_distance(const uint8_t* occupied, Shape3 shape, uint8_t* dst, int threads) noexcept;

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
