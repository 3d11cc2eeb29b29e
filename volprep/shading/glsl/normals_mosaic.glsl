//: GLSL ES 1.00. In: one or several textures, 2D, CLAMP_TO_EDGE, LINEAR or NEAREST as their entry says, and
//: LAST_SLICE of
//: the volume's mosaic. Constants: the layout of one mosaic without gutters. Slots: normal_units declares the
//: samplers; normal_unit leaves the number of the texture in `unit`, and the tile's in it in `tile`; normal_fetch reads
//: the texture at `place`; normal_code gives decoded_normal(texel); normal_slices gives normal_at(position).
// Directions of gradients along the volume's axes, about 1 long; 0 where there is none. In tiles of one slice each.
//#part normal_units
const vec2 NORMAL_TILE = $NORMAL_TILE;
const vec2 NORMAL_MOSAIC = $NORMAL_MOSAIC;
const float NORMAL_TILES_X = $NORMAL_TILES_X;
vec4 normal_texel(float tile, vec2 at) {
  //#part normal_unit
  // Half a tile away from the rounding of an exact quotient; half a texel inside the tile, away from its neighbours.
  float row = floor((tile + 0.5) / NORMAL_TILES_X);
  vec2 corner = vec2(tile - row * NORMAL_TILES_X, row) * NORMAL_TILE;
  vec2 place = (corner + clamp(at, vec2(0.5), NORMAL_TILE - 0.5)) / NORMAL_MOSAIC;
  //#part normal_fetch
}
//#part normal_code
//#part normal_slices
