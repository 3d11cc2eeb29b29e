//: GLSL ES 3.00. In: u_normals, 3D, of the level's shape, CLAMP_TO_EDGE, LINEAR or NEAREST as its entry says. Slots:
//: normal_code gives decoded_normal(texel).
// Directions of gradients along the volume's axes, about 1 long; 0 where there is none.
uniform highp sampler3D u_normals;
//#part normal_code
vec3 normal_at(vec3 at) {
  return decoded_normal(textureLod(u_normals, at, 0.0));
}
