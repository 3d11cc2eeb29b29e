//: Four consecutive slices share a texel.
// Half a slice away from the rounding of an exact quotient.
float tile = floor((slice + 0.5) / 4.0);
float channel = slice - tile * 4.0;
