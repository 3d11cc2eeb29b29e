//: Compute shader, GLSL ES 3.10, of one invocation: the second step of a counting sort.
precision highp float;
layout(local_size_x = 1) in;
// Of each group, the number of its tiles; then the number of tiles before it.
layout(std430, binding = 1) buffer Groups {
  uint groups[];
};

void main() {
  uint before = 0u;
  for (int group = 0; group < groups.length(); group++) {
    uint tiles = groups[group];
    groups[group] = before;
    before += tiles;
  }
}
