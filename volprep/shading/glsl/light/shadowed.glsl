//: A light with a place, in whose way something may lie. light_reaching gives the part of it that arrives, of a place
//: in box millimetres, and of the side of a surface (SIDE). In the loop, after `medium`.
if (medium.a > 0.0) {
  vec3 place = $LIT_AT;
  vec3 place_mm = place / $POSITION_PER_MM;
  vec3 normal = $NORMAL;
  float squared = dot(normal, normal);
  normal *= (dot(normal, direction) > 0.0 ? -1.0 : 1.0) * inversesqrt(max(squared, 1e-30));
  float reaching = light_reaching(place_mm$SIDE);
  vec3 surface = lit(medium.rgb, normal, normalize(u_light_mm - place_mm), -direction, reaching);
  // With a short normal a sample is hardly a surface: light takes nothing from its colour, but a shadow does.
  vec3 shadowed = medium.rgb * mix(AMBIENT, 1.0, reaching);
  medium.rgb = mix(shadowed, surface, squared / (squared + $SOFT_SQUARED));
}
