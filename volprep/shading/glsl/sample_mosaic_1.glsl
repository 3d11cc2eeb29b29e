//: A mosaic with one slice in a texel: two fetches for each sample. voxel_texel gives all channels of the voxels.
//#part tile
const float LAST_SLICE = $LAST_SLICE;
vec4 voxel_texel(vec3 at) {
  float slice = clamp(at.z - 0.5, 0.0, LAST_SLICE);
  float lower = floor(slice);
  // At the last slice the one above it has weight 0.
  return mix(tile_texel(lower, at.xy), tile_texel(lower + 1.0, at.xy), slice - lower);
}
//#part stored_value
