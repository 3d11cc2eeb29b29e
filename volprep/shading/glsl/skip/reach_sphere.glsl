//: Tables of kind euclidean: the entry is 1 + r where the block is empty, and so is all within r blocks of its points.
// Steps until the ray leaves the block, or all that lies within entry - 1 blocks of it, whichever is later: both are
// empty.
float steps_to_leave(vec3 at, vec3 slope, vec3 block, float entry) {
  vec3 end = block + vec3(greaterThan(slope, vec3(0.0)));
  vec3 steps = (end - at) / slope;
  return max(min(steps.x, min(steps.y, steps.z)), (entry - 1.0) / length(slope));
}
