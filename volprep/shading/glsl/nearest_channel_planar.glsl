//: Red holds the first slices of a texture, green those that follow, and so on.
// Half a slice away from the rounding of an exact quotient.
float channel = floor((slice + 0.5) / $TILES);
float tile = slice - channel * $TILES;
//#part planar_unit
