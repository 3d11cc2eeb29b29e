//: The samplers of a mosaic in several textures. GLSL ES 1.00 cannot index samplers, so that a chain chooses.
//#each UNIT
uniform highp sampler2D u_volume_$UNIT;
//#end
uniform highp sampler2D u_volume_$LAST_UNIT;
vec4 unit_texel(float unit, vec2 place) {
  //#each UNIT
  if (unit < $UNIT.5) {
    return texture2D(u_volume_$UNIT, place);
  }
  //#end
  return texture2D(u_volume_$LAST_UNIT, place);
}
