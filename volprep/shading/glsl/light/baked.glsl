//: GLSL ES 3.00. In: u_light, RG8, 3D, CLAMP_TO_EDGE, LINEAR; stored, the normalised stored value at the sample.
//: Constants: LIGHT_FROM_BOX, per millimetre; LARGEST_LIGHT; LIGHT_OF, of `part` of it; SHARE_SCALE and SHARE_OFFSET.
//: Sections: start, before the loop; sample, in it, after `medium`.
// Light that was computed once: two parts of LARGEST_LIGHT, where the share is 0 and where it is 1.
uniform highp sampler3D u_light;
const vec3 LIGHT_FROM_BOX = $LIGHT_FROM_BOX;
const float LARGEST_LIGHT = $LARGEST_LIGHT;
float baked_light(vec3 at, float stored) {
  vec2 ends = textureLod(u_light, at, 0.0).rg;
  // In a wall that is thinner than a texel, the value says how deep in the wall the sample is.
  float part = mix(ends.x, ends.y, clamp(stored * $SHARE_SCALE + $SHARE_OFFSET, 0.0, 1.0));
  return $LIGHT_OF;
}
//#section start
vec3 light_from_position = LIGHT_FROM_BOX / $POSITION_PER_MM;
float stored = 0.0;
//#section sample
if (medium.a > 0.0) {
  medium.rgb *= baked_light(light_from_position * ($LIT_AT), stored);
}
