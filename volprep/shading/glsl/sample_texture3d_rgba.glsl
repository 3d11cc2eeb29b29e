//: GLSL ES 3.00. In: u_volume, RG8, RGB8 or RGBA8, 3D, CLAMP_TO_EDGE, LINEAR or NEAREST. Slot: place gives positions.
//: $LOD names the mipmap, because inside a loop that not all pixels run there are no derivatives to choose one.
// The volume as a 3D texture of several components. The sampler's CLAMP_TO_EDGE holds the outer half voxel.
uniform highp sampler3D u_volume;
//#part place
vec4 voxel_texel(vec3 at) {
  return textureLod(u_volume, at, $LOD);
}
