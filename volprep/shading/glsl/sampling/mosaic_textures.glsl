//: Additions to mosaic.glsl for a mosaic in several textures: its samplers, and the sections unit and fetch.
//: GLSL ES 1.00 cannot index samplers, so a chain chooses. Words: TILES, tiles of a texture; UNIT, all textures but the
//: last.
//#each UNIT
uniform highp sampler2D ${SAMPLER}_$UNIT;
//#end
uniform highp sampler2D ${SAMPLER}_$LAST_UNIT;
vec4 unit_${TEXEL}(float unit, vec2 place) {
  //#each UNIT
  if (unit < $UNIT.5) {
    return $TEXTURE_2D(${SAMPLER}_$UNIT, place);
  }
  //#end
  return $TEXTURE_2D(${SAMPLER}_$LAST_UNIT, place);
}
//#section unit
// Tiles are numbered through all textures.
float unit = floor((tile + 0.5) / $TILES);
tile -= unit * $TILES;
//#section fetch
return unit_${TEXEL}(unit, place / ${P}MOSAIC);
