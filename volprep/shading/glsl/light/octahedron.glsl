//: In: a point of the square from -1 to 1. Out: the unit vector that the unfolded octahedron has there.
// The unit vector that the unfolded octahedron has at a point of the square from -1 to 1.
vec3 folded(vec2 square) {
  float height = 1.0 - abs(square.x) - abs(square.y);
  // Outside the inner diamond is the lower half, folded outwards.
  vec2 over = vec2(max(-height, 0.0));
  return normalize(vec3(square - mix(over, -over, vec2(lessThan(square, vec2(0.0)))), height));
}
