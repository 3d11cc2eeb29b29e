//: Light that stays as it was computed. Slots: light_texels declares the texture, the section texture3d or mosaic;
//: light_places, of a mosaic: the section places; light_ends mixes the ends of `part`, the section one_number (8 bits
//: of two components) or two_colours (8 bits of four). In: stored, the normalised stored value at the sample. Words:
//: LIGHT, the type of light; LIGHT_TEXEL reads at `at`; NUMBERS, the components. Constants: LIGHT_FROM_BOX, per
//: millimetre; LIGHT_START, where the box begins; LARGEST_LIGHT; LIGHT_OF, of `part` of it; SHARE_SCALE and
//: SHARE_OFFSET. Sections: start, before the loop; sample, in it, after `medium`.
//#part light_texels

// Light that was computed once, in parts of LARGEST_LIGHT, where the share is 0 and where it is 1.
const vec3 LIGHT_FROM_BOX = $LIGHT_FROM_BOX;
const vec3 LIGHT_START = $LIGHT_START;  // the middle of the first texel lies on the faces of the box
const float LARGEST_LIGHT = $LARGEST_LIGHT;
$LIGHT baked_light(vec3 at, float stored) {
  // In a wall that is thinner than a texel, the value says how deep in the wall the sample is.
  float share = clamp(stored * $SHARE_SCALE + $SHARE_OFFSET, 0.0, 1.0);
  //#part light_places
  //#part light_ends
  return $LIGHT_OF;
}
//#section texture3d
//: GLSL ES 3.00. 3D, RG8, RGB8 or RGBA8, CLAMP_TO_EDGE, LINEAR.
uniform highp sampler3D u_light;
//#section mosaic
//: A mosaic of one slice in a tile and without gutters: 2D, CLAMP_TO_EDGE, LINEAR.
// Light is a mosaic, in tiles of one slice each.
const vec2 LIGHT_PITCH = $LIGHT_PITCH;
const vec2 LIGHT_MOSAIC = $LIGHT_MOSAIC;
const float LIGHT_TILES_X = $LIGHT_TILES_X;
const float LIGHT_LAST_SLICE = $LIGHT_LAST_SLICE;
vec2 light_place(float tile, vec2 at) {
  // Half a tile away from the rounding of an exact quotient.
  float row = floor((tile + 0.5) * (1.0 / LIGHT_TILES_X));
  float column = tile - row * LIGHT_TILES_X;
  // Samples are between the middles of the outer texels, so that the linear filter does not reach a neighbour.
  return (vec2(column, row) * LIGHT_PITCH + at) * (1.0 / LIGHT_MOSAIC);
}

uniform highp sampler2D u_light;
vec4 light_texel(vec4 places, float between) {
  return mix($TEXTURE_2D(u_light, places.xy), $TEXTURE_2D(u_light, places.zw), between);
}
//#section places
float slice = clamp(at.z - 0.5, 0.0, LIGHT_LAST_SLICE);
float lower = floor(slice);
// At the last slice the one above it has weight 0.
vec4 places = vec4(light_place(lower, at.xy), light_place(lower + 1.0, at.xy));
//#section one_number
vec2 ends = $LIGHT_TEXEL.$NUMBERS;
float part = mix(ends.x, ends.y, share);
//#section two_colours
vec4 ends = $LIGHT_TEXEL;
vec2 numbers = mix(ends.rg, ends.ba, share);
// The light of a number in its colour and of the other in the rest of white.
vec3 part = mix(vec3(numbers.y), vec3(numbers.x), $FIRST_COLOUR);
//#section start
vec3 light_from_position = LIGHT_FROM_BOX / $POSITION_PER_MM;
float stored = 0.0;
//#section sample
if (medium.a > 0.0) {
  medium.rgb *= baked_light(light_from_position * ($LIT_AT) + LIGHT_START, stored);
}
