//: GLSL ES 1.00. A mosaic: slices as tiles of one or several textures, 2D, CLAMP_TO_EDGE, at most 4096 texels wide,
//: where float32 places a texel's centre to 2^-11 of a texel. One instance for the volume, one for normals, one for a
//: skip table. Words: ABOUT, its contents; P, in front of the names of constants; TEXEL, the function; SAMPLER; its
//: layout. Slots: sampler declares it; unit leaves the number of the texture in `unit`, and the tile's in it in `tile`;
//: place is the section clamped, gutter or centre; fetch reads the texture.
// $ABOUT
//#part sampler
const vec2 ${P}PITCH = $PITCH;
const vec2 ${P}MOSAIC = $MOSAIC;
const float ${P}TILES_X = $TILES_X;
vec4 $TEXEL(float tile, vec2 at) {
  //#part unit
  // Half a tile away from the rounding of an exact quotient.
  float row = floor((tile + 0.5) / ${P}TILES_X);
  float column = tile - row * ${P}TILES_X;
  //#part place
  //#part fetch
}
//#section sampler
uniform highp sampler2D $SAMPLER;
//#section clamped
// Half a texel inside the tile, so that the linear filter never reaches a neighbour.
vec2 place = vec2(column, row) * ${P}PITCH + clamp(at, vec2(0.5), $LAST_PLACE);
//#section gutter
// The linear filter reaches half a texel into the gutter, which repeats the tile's edge.
vec2 place = vec2(column, row) * ${P}PITCH + $GUTTER + at;
//#section centre
// At the centre of a texel the linear filter gives the texel itself.
vec2 place = vec2(column, row) * ${P}PITCH + at;
//#section fetch
return $TEXTURE_2D($SAMPLER, place / ${P}MOSAIC);
