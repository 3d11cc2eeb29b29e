//: Tables of kind pyramid: the entry is 1 + l where the cell of edge 2^l that holds the block is empty.
// Steps until the ray leaves the cell of edge 2^(entry - 1) blocks that holds the block: all of it is empty.
float steps_to_leave(vec3 at, vec3 slope, vec3 block, float entry) {
  float edge = exp2(entry - 1.0);
  vec3 corner = floor((block + 0.5) / edge) * edge;
  vec3 end = corner + edge * vec3(greaterThan(slope, vec3(0.0)));
  vec3 steps = (end - at) / slope;
  return min(steps.x, min(steps.y, steps.z));
}
