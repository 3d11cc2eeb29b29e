//: Codes that must not be filtered: those of the voxel that the position is in.
vec3 normal_at(vec3 at) {
  return decoded_normal(normal_texel(clamp(floor(at.z), 0.0, LAST_SLICE), at.xy));
}
