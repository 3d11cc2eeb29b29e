//: A light with a place, in whose way something may lie. light_reaching gives the part of it that arrives, of a place
//: in box millimetres, and of the side of a surface (SIDE). In the loop, after `medium`.
if (medium.a > 0.0) {
  vec3 place = $LIT_AT;
  vec3 place_mm = place / $POSITION_PER_MM;
  vec3 normal = $NORMAL;
  float squared = dot(normal, normal);
  if (squared > $LEAST_SQUARED) {
    normal *= (dot(normal, direction) > 0.0 ? -1.0 : 1.0) * inversesqrt(squared);
    vec3 to_light = normalize(u_light_mm - place_mm);
    // A surface that faces away from the light is in its own shadow.
    float reaching = dot(normal, to_light) > 0.0 ? light_reaching(place_mm$SIDE) : 0.0;
    medium.rgb = lit(medium.rgb, normal, to_light, -direction, reaching);
  } else {
    // A sample without a normal is no surface: light takes nothing from its colour, but a shadow does.
    medium.rgb *= mix(AMBIENT, 1.0, light_reaching(place_mm$SIDE));
  }
}
