//: A mosaic of one slice: the field does not change along z. voxel_texel gives all channels of the voxels.
//#part tile
vec4 voxel_texel(vec3 at) {
  return tile_texel(0.0, at.xy);
}
//#part stored_value
