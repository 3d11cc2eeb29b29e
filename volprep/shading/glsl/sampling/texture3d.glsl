//: GLSL ES 3.00. In: u_volume, R8, R16 or R16F, or several components as RG8, RGB8 or RGBA8; 3D, CLAMP_TO_EDGE, LINEAR
//: or NEAREST. $OF tells channels apart in a picture of several. $FUNCTION is stored_value with one component, or
//: voxel_texel with all. $LOD names the mipmap, because inside a loop that not all pixels run there are no derivatives
//: to choose one.
// The volume as a 3D texture: normalised values, 0 to 1. The sampler's CLAMP_TO_EDGE holds the outer half voxel.
uniform highp sampler3D u_volume$OF;
$FUNCTION$OF(vec3 at) {
  return textureLod(u_volume$OF, at, $LOD)$COMPONENT;
}
