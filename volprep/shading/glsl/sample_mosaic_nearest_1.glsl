//: A mosaic of labels with one slice in a texel: one fetch for each sample, of the voxel that it is in.
//#part tile
const float LAST_SLICE = $LAST_SLICE;
float stored_value(vec3 at) {
  return tile_texel(clamp(floor(at.z), 0.0, LAST_SLICE), at.xy).r;
}
