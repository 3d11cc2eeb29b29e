//: The greatest value between two faces of a cell, where the field along a ray is a cubic. Both dialects. Sections:
//: greatest, the function; sampled, the four values of a piece of the ray.
//#section greatest
// The greatest value of the cubic with these values at 0, 1/3, 2/3 and 1, from 0 to 1, and its place: at an end, or
// where its slope is 0. It is a value of the cubic wherever float32 finds that place: never too great.
vec2 greatest_of_cubic(vec4 values) {
  mat4 from_values = mat4(
    vec4(1.0, -5.5, 9.0, -4.5),
    vec4(0.0, 9.0, -22.5, 13.5),
    vec4(0.0, -4.5, 18.0, -13.5),
    vec4(0.0, 1.0, -4.5, 4.5)
  );
  vec4 cubic = from_values * values;
  float root = sqrt(max(cubic.z * cubic.z - 3.0 * cubic.y * cubic.w, 0.0));
  // Of the two ways to write the root that is a maximum, the one in which nothing cancels.
  float at = cubic.z < 0.0 ? cubic.y / (root - cubic.z) : (root + cubic.z) / max(-3.0 * cubic.w, 1e-30);
  at = clamp(at, 0.0, 1.0);
  float there = cubic.x + at * (cubic.y + at * (cubic.z + at * cubic.w));
  vec2 greatest = there >= values.x ? vec2(there, at) : vec2(values.x, 0.0);
  greatest = values.y > greatest.x ? vec2(values.y, 1.0 / 3.0) : greatest;
  greatest = values.z > greatest.x ? vec2(values.z, 2.0 / 3.0) : greatest;
  return values.w > greatest.x ? vec2(values.w, 1.0) : greatest;
}
//#section sampled
vec3 third = stride * ((reached - walked) / 3.0);
vec3 walked_at = start + stride * walked;
vec4 values = vec4(front, stored_value(walked_at + third), stored_value(walked_at + 2.0 * third), back);
