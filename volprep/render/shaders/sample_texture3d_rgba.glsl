//: GLSL ES 3.00. In: u_volume, RGBA8, 3D, CLAMP_TO_EDGE, LINEAR or NEAREST; u_texture_from_box, per millimetre.
//: The mipmap is named, because inside a loop that not all pixels run there are no derivatives to choose one. Slot:
//: mipmap declares what names it, where there are several.
// The volume as a 3D texture of four channels. u_texture_from_box is 1 / (voxels * spacing) of the level; the sampler's
// CLAMP_TO_EDGE holds the outer half voxel.
uniform highp sampler3D u_volume;
uniform vec3 u_texture_from_box;
//#part mipmap
vec3 position(vec3 box_mm) {
  return box_mm * u_texture_from_box;
}
vec4 voxel_texel(vec3 at) {
  return textureLod(u_volume, at, $LOD);
}
