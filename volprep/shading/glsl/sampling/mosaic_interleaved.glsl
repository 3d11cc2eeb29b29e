//: A mosaic with four consecutive slices in a texel (RGBA): five fetches for four samples, on average.
const float LAST_SLICE = $LAST_SLICE;
float $STORED(vec3 at) {
  float slice = clamp(at.z - 0.5, 0.0, LAST_SLICE);
  float tile = floor(slice / 4.0);
  float channel = slice - tile * 4.0;
  // Four slices share a tile, one a channel: one fetch serves both neighbours, except between channels 3 and 0.
  vec4 weights = max(1.0 - abs(vec4(0.0, 1.0, 2.0, 3.0) - channel), 0.0);
  float value = dot(tile_texel(tile, at.xy), weights);
  if (channel > 3.0) {
    value += tile_texel(tile + 1.0, at.xy).r * (channel - 3.0);
  }
  return value;
}
