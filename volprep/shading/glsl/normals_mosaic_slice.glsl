//: Normals of one slice: they do not change along z.
vec3 normal_at(vec3 at) {
  return decoded_normal(normal_texel(0.0, at.xy));
}
