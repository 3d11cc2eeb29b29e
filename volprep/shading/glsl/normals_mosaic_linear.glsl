//: Codes that may be filtered are filtered between slices, too.
vec3 normal_at(vec3 at) {
  float slice = clamp(at.z - 0.5, 0.0, LAST_SLICE);
  float lower = floor(slice);
  // At the last slice the one above it has weight 0.
  return decoded_normal(mix(normal_texel(lower, at.xy), normal_texel(lower + 1.0, at.xy), slice - lower));
}
