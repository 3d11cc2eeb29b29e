//: Slots: light_texels declares the textures, as the section texture3d or as mosaics; light_ends mixes the ends of
//: `part`, the section one_texture (8 bits of two components) or two_textures; light_around, where an app turns the
//: light: the section environment. In: stored, the normalised stored value at the sample; u_environment, columns of
//: RGB. Words: LIGHT, the type of light; PARTS, of what the textures hold; LIGHT_TEXEL reads at `at`, from two textures
//: LIGHT_TEXEL and HIGH_TEXEL; NUMBERS, the components. Constants: LIGHT_FROM_BOX, per millimetre; LIGHT_START, where
//: the box begins; LARGEST_LIGHT; LIGHT_OF, of `part` of it; SHARE_SCALE and SHARE_OFFSET. Sections: start, before the
//: loop; sample, in it, after `medium`.
//#part light_texels

// Light that was computed once, in parts of LARGEST_LIGHT, where the share is 0 and where it is 1.
const vec3 LIGHT_FROM_BOX = $LIGHT_FROM_BOX;
const vec3 LIGHT_START = $LIGHT_START;  // the middle of the first texel lies on the faces of the box
const float LARGEST_LIGHT = $LARGEST_LIGHT;
//#part light_around
$LIGHT baked_light(vec3 at, float stored) {
  // In a wall that is thinner than a texel, the value says how deep in the wall the sample is.
  float share = clamp(stored * $SHARE_SCALE + $SHARE_OFFSET, 0.0, 1.0);
  //#part light_ends
  return $LIGHT_OF;
}
//#section texture3d
//: GLSL ES 3.00. 3D, RG8, RGB8 or RGBA8, CLAMP_TO_EDGE, LINEAR.
uniform highp sampler3D $LIGHT_SAMPLER;
//#section environment
// Red, green and blue of the light around, as shares of the four environments whose light the textures hold.
uniform mat4 u_environment;
//#section one_texture
vec2 ends = $LIGHT_TEXEL.$NUMBERS;
float part = mix(ends.x, ends.y, share);
//#section two_textures
$PARTS part = mix($LIGHT_TEXEL$NUMBERS, $HIGH_TEXEL$NUMBERS, share);
//#section start
vec3 light_from_position = LIGHT_FROM_BOX / $POSITION_PER_MM;
float stored = 0.0;
//#section sample
if (medium.a > 0.0) {
  medium.rgb *= baked_light(light_from_position * ($LIT_AT) + LIGHT_START, stored);
}
