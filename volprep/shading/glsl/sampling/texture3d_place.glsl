//: GLSL ES 3.00. In: u_texture_from_box, per millimetre. Slot: mipmap, where the texture has several: section mipmap
//: declares u_mipmap, from 0 to the number of mipmaps less 1; the sampler has LINEAR_MIPMAP_LINEAR.
// Positions are texture coordinates: u_texture_from_box is 1 / (voxels * spacing) of the level.
uniform vec3 u_texture_from_box;
//#part mipmap
vec3 position(vec3 box_mm) {
  return box_mm * u_texture_from_box;
}
//#section mipmap
// Which mipmap is read; between two whole numbers both are mixed.
uniform float u_mipmap;
