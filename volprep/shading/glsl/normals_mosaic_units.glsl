//: The samplers of a mosaic of normals in several textures. GLSL ES 1.00 cannot index samplers: a chain chooses.
//#each NORMAL_UNIT
uniform highp sampler2D u_normals_$NORMAL_UNIT;
//#end
uniform highp sampler2D u_normals_$LAST_NORMAL_UNIT;
vec4 normal_unit_texel(float unit, vec2 place) {
  //#each NORMAL_UNIT
  if (unit < $NORMAL_UNIT.5) {
    return texture2D(u_normals_$NORMAL_UNIT, place);
  }
  //#end
  return texture2D(u_normals_$LAST_NORMAL_UNIT, place);
}
