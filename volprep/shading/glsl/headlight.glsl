//: In the loop, after `medium`: diffuse light from the viewer, on both sides of a surface.
if (medium.a > 0.0) {
  vec3 normal = normal_at(start + stride * i);
  float squared = dot(normal, normal);
  // What has no normal is no surface, and keeps its colour.
  if (squared > $LEAST_SQUARED) {
    medium.rgb *= abs(dot(normal, direction)) * inversesqrt(squared);
  }
}
