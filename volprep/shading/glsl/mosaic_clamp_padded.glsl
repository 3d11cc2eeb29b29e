//: A place in a tile of a mosaic whose tiles are padded to whole compressed blocks.
// Half a texel inside the tile, so that the linear filter never reaches a neighbour.
vec2 place = vec2(column, row) * PITCH + clamp(at, vec2(0.5), $LAST_PLACE);
