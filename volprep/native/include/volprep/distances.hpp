// Distance of every cell to the nearest occupied one: how far a ray may go without looking.
#pragma once

#include "volprep/shape.hpp"

namespace volprep {

// dst[c] = the least max(|dz|, |dy|, |dx|) to a cell o with occupied[o] != 0, at most 255; 255 everywhere if there is
// none. So all cells nearer to c than dst[c], in all directions, are empty; everything outside the volume counts
// as empty. dst may not overlap occupied.
void chebyshev_distance(const uint8_t* occupied, Shape3 shape, uint8_t* dst, int threads) noexcept;

}  // namespace volprep
