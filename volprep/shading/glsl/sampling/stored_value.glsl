//: The only value of a voxel that is drawn.
float stored_value(vec3 at) {
  return voxel_texel(at).$COMPONENT;
}
