//: The only value of a texel that is drawn.
float stored_value(vec3 at) {
  return voxel_texel(at).$COMPONENT;
}
