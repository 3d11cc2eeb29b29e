//: A mosaic with one slice in a tile (LUMINANCE): two fetches for each sample.
//#part tile
const float LAST_SLICE = $LAST_SLICE;
float stored_value(vec3 at) {
  float slice = clamp(at.z - 0.5, 0.0, LAST_SLICE);
  float lower = floor(slice);
  // At the last slice the one above it has weight 0.
  return mix(tile_texel(lower, at.xy).r, tile_texel(lower + 1.0, at.xy).r, slice - lower);
}
