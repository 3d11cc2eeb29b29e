//: Compute shader, GLSL ES 3.10: the third step of a counting sort.
precision highp float;
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer TileGroups {
  uint tile_groups[];
};
layout(std430, binding = 1) buffer Groups {
  uint groups[];
};
// The tiles, in ascending order of cost.
layout(std430, binding = 2) writeonly buffer Sorted {
  uint sorted[];
};

void main() {
  uint tile = gl_GlobalInvocationID.x;
  if (tile < uint(tile_groups.length())) {
    sorted[atomicAdd(groups[tile_groups[tile]], 1u)] = tile;
  }
}
