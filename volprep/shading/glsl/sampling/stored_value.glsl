//: The only value of a voxel that is drawn.
float $STORED(vec3 at) {
  return voxel_texel(at).$COMPONENT;
}
