//: Tables of kinds blocks, table16, distance and octants: all blocks nearer than the entry are empty.
// Steps until the ray leaves the blocks that are nearer than the entry, which is not 0: all of them are empty.
float steps_to_leave(vec3 at, vec3 slope, vec3 block, float entry) {
  vec3 end = block + mix(vec3(1.0 - entry), vec3(entry), vec3(greaterThan(slope, vec3(0.0))));
  vec3 steps = (end - at) / slope;
  return min(steps.x, min(steps.y, steps.z));
}
