//: A mosaic with three slices and the one after them in a texel (RGBA): one fetch for each sample.
const float LAST_SLICE = $LAST_SLICE;
const float LAST_TILE = $LAST_TILE;
float $STORED(vec3 at) {
  float slice = clamp(at.z - 0.5, 0.0, LAST_SLICE);
  // The last slice may be the fourth of its tile, and the first of none.
  float tile = min(floor(slice / 3.0), LAST_TILE);
  float channel = slice - tile * 3.0;
  vec4 weights = max(1.0 - abs(vec4(0.0, 1.0, 2.0, 3.0) - channel), 0.0);
  return dot(tile_texel(tile, at.xy), weights);
}
