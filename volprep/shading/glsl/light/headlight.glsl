//: Diffuse light from the viewer, on both sides of a surface. Sections: start, before the loop; sample, in it, after
//: `medium`; and where functions light samples, declared and begin in place of start.
//#section start
// Rays are straight: the direction from the viewer is the same along a ray.
vec3 direction = normalize($FROM_VIEWER);
//#section declared
// The direction from the viewer, the same along a ray.
vec3 direction;
//#section begin
direction = normalize($FROM_VIEWER);
//#section sample
if (medium.a > 0.0) {
  vec3 normal = $NORMAL;
  float along = dot(normal, direction);
  // The cosine of ray and normal. With a short normal a sample is hardly a surface, and keeps its colour.
  medium.rgb *= sqrt((along * along + $SOFT_SQUARED) / (dot(normal, normal) + $SOFT_SQUARED));
}
