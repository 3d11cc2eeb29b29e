//: Diffuse light from the viewer, on both sides of a surface. Sections: start, before the loop; sample, in it, after
//: `medium`.
//#section start
// Rays are straight: the direction from the viewer is the same along a ray.
vec3 direction = normalize($FROM_VIEWER);
//#section sample
if (medium.a > 0.0) {
  vec3 normal = $NORMAL;
  float squared = dot(normal, normal);
  // A sample without a normal is no surface, and keeps its colour.
  if (squared > $LEAST_SQUARED) {
    medium.rgb *= abs(dot(normal, direction)) * inversesqrt(squared);
  }
}
