//: A mosaic of labels with four slices in a texel (RGBA): one fetch for each sample, of the voxel that it is in.
//: Slot: nearest_channel gives `tile`, and `channel` in it, of `slice`.
//#part tile
const float LAST_SLICE = $LAST_SLICE;
float stored_value(vec3 at) {
  float slice = clamp(floor(at.z), 0.0, LAST_SLICE);
  //#part nearest_channel
  return dot(tile_texel(tile, at.xy), vec4(equal(vec4(0.0, 1.0, 2.0, 3.0), vec4(channel))));
}
