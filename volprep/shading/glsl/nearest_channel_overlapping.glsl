//: Three consecutive slices, and the one after them, share a texel.
// The last slice may be the fourth of its tile, and the first of none.
float tile = min(floor((slice + 0.5) / 3.0), $LAST_TILE);
float channel = slice - tile * 3.0;
