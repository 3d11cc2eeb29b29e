//: GLSL ES 3.00. In: u_texture_from_box, per millimetre. Slot: mipmap declares what names it, where there are several.
// Positions are texture coordinates: u_texture_from_box is 1 / (voxels * spacing) of the level.
uniform vec3 u_texture_from_box;
//#part mipmap
vec3 position(vec3 box_mm) {
  return box_mm * u_texture_from_box;
}
