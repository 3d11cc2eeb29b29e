//: Slots: normal_texels declares the texture, as the section texture3d or as a mosaic; normal_code gives
//: decoded_normal(texel). NORMAL_TEXEL reads the texel at `at`.
// Directions of gradients along the volume's axes, about 1 long; 0 without a gradient.
//#part normal_texels

//#part normal_code

vec3 normal_at(vec3 at) {
  return decoded_normal($NORMAL_TEXEL);
}
//#section texture3d
//: GLSL ES 3.00. 3D, of the level's shape, CLAMP_TO_EDGE, LINEAR or NEAREST as its entry says.
uniform highp sampler3D u_normals;
