//: A mosaic whose red channel holds the first slices of a texture, green the next ones, and so on: two fetches for
//: each sample. Slot: planar_unit, where there are several textures: section unit.
const float LAST_SLICE = $LAST_SLICE;
float slice_value(float slice, vec2 at) {
  float channel = floor((slice + 0.5) / $TILES);
  float tile = slice - channel * $TILES;
  //#part planar_unit
  return dot(tile_texel(tile, at), max(1.0 - abs(vec4(0.0, 1.0, 2.0, 3.0) - channel), 0.0));
}
float $STORED(vec3 at) {
  float slice = clamp(at.z - 0.5, 0.0, LAST_SLICE);
  float lower = floor(slice);
  // At the last slice the one above it has weight 0.
  return mix(slice_value(lower, at.xy), slice_value(lower + 1.0, at.xy), slice - lower);
}
//#section unit
// Channels are numbered through all textures: four of them make the next texture's tiles.
float texture_before = floor((channel + 0.5) / 4.0);
channel -= texture_before * 4.0;
tile += texture_before * $TILES;
