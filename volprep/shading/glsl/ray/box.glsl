//: Slab test (Kay and Kajiya 1986). In: a ray, origin + t * ray with t from 0 to 1, in box millimetres, highp. Words:
//: two opposite corners of the box.
// Fractions of the ray where it enters and leaves the box. The second is less than the first if the ray misses it.
vec2 clip_to_box(vec3 origin, vec3 ray) {
  // Along an axis that the ray does not move on, division by zero is undefined in GLSL ES; a slope of 1e-7 moves the
  // ray by less than float32 resolves.
  vec3 least = vec3(1e-7 * length(ray));
  vec3 slope = mix(ray, least, vec3(lessThan(abs(ray), least)));
  vec3 low = ($LOW_CORNER_MM - origin) / slope;
  vec3 high = ($HIGH_CORNER_MM - origin) / slope;
  vec3 enter = min(low, high);
  vec3 leave = max(low, high);
  return vec2(max(max(enter.x, enter.y), max(enter.z, 0.0)), min(min(leave.x, leave.y), min(leave.z, 1.0)));
}
//#section inside
vec2 inside = clip_to_box(origin, ray);
