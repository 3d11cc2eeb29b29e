//: A mosaic of labels with four slices in a texel (RGBA): one fetch for each sample, of the voxel that it is in.
//: Slot: nearest_channel gives `tile`, and `channel` in it, of `slice`: the section of the order of slices. In the
//: section planar, slot planar_unit as in mosaic_planar.glsl.
const float LAST_SLICE = $LAST_SLICE;
float $STORED(vec3 at) {
  float slice = clamp(floor(at.z), 0.0, LAST_SLICE);
  //#part nearest_channel
  return dot(tile_texel(tile, at.xy), vec4(equal(vec4(0.0, 1.0, 2.0, 3.0), vec4(channel))));
}
//#section interleaved
// Four consecutive slices share a tile. Half a slice away from the rounding of an exact quotient.
float tile = floor((slice + 0.5) / 4.0);
float channel = slice - tile * 4.0;
//#section overlapping
// The last slice may be the fourth of its tile, and the first of none.
float tile = min(floor((slice + 0.5) / 3.0), $LAST_TILE);
float channel = slice - tile * 3.0;
//#section planar
// Red holds the first slices of a texture, green the next ones. Half a slice away from an exact quotient.
float channel = floor((slice + 0.5) / $TILES);
float tile = slice - channel * $TILES;
//#part planar_unit
