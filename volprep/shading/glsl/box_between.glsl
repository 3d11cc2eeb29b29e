//: Slab test (Kay and Kajiya 1986), as in box.glsl, for a part of the volume that changes from picture to picture.
// Fractions of the ray at which it enters and leaves the box from u_box_low_mm to u_box_high_mm: no interval if it
// misses.
uniform vec3 u_box_low_mm;
uniform vec3 u_box_high_mm;
vec2 clip_to_box(vec3 origin, vec3 ray) {
  // Along an axis that the ray does not move on, division by zero is undefined in GLSL ES; a slope of 1e-7 moves the
  // ray by less than float32 resolves.
  vec3 least = vec3(1e-7 * length(ray));
  vec3 slope = mix(ray, least, vec3(lessThan(abs(ray), least)));
  vec3 low = (u_box_low_mm - origin) / slope;
  vec3 high = (u_box_high_mm - origin) / slope;
  vec3 enter = min(low, high);
  vec3 leave = max(low, high);
  return vec2(max(max(enter.x, enter.y), max(enter.z, 0.0)), min(min(leave.x, leave.y), min(leave.z, 1.0)));
}
