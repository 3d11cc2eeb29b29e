//: A mosaic of one slice: the field does not change along z.
//#part tile
float stored_value(vec3 at) {
  return tile_texel(0.0, at.xy).r;
}
