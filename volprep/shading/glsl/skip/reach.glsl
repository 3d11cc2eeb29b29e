//: How far a ray may jump. Sections by the kind of the table: box, sphere, pyramid.
//#section box
//: Tables of kinds blocks, table16, distance and octants: all blocks nearer than the entry are empty.
// Steps until the ray leaves the blocks that are nearer than the entry, which is not 0: all of them are empty.
float steps_to_leave(vec3 at, vec3 slope, vec3 block, float entry) {
  vec3 end = block + mix(vec3(1.0 - entry), vec3(entry), vec3(greaterThan(slope, vec3(0.0))));
  vec3 steps = (end - at) / slope;
  return min(steps.x, min(steps.y, steps.z));
}
//#section sphere
//: Tables of kind euclidean: the entry is 1 + r where the block is empty, and so is all within r blocks of its points.
// Steps until the ray leaves the block, or all that lies within entry - 1 blocks of it, whichever is later: both are
// empty.
float steps_to_leave(vec3 at, vec3 slope, vec3 block, float entry) {
  vec3 end = block + vec3(greaterThan(slope, vec3(0.0)));
  vec3 steps = (end - at) / slope;
  return max(min(steps.x, min(steps.y, steps.z)), (entry - 1.0) / length(slope));
}
//#section pyramid
//: Tables of kind pyramid: the entry is 1 + l where the cell of edge 2^l that holds the block is empty.
// Steps until the ray leaves the cell of edge 2^(entry - 1) blocks that holds the block: all of it is empty.
float steps_to_leave(vec3 at, vec3 slope, vec3 block, float entry) {
  float edge = exp2(entry - 1.0);
  vec3 corner = floor((block + 0.5) / edge) * edge;
  vec3 end = corner + edge * vec3(greaterThan(slope, vec3(0.0)));
  vec3 steps = (end - at) / slope;
  return min(steps.x, min(steps.y, steps.z));
}
