//: A place in a tile of a mosaic whose tiles abut.
// Half a texel inside the tile, so that the linear filter never reaches a neighbour.
vec2 place = vec2(column, row) * PITCH + clamp(at, vec2(0.5), PITCH - 0.5);
