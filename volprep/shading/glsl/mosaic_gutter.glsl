//: A place in a tile of a mosaic whose tiles are surrounded by their own edge.
// The linear filter reaches half a texel into the gutter, which repeats the tile's edge.
vec2 place = vec2(column, row) * PITCH + $GUTTER + at;
