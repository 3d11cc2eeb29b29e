//: GLSL ES 3.00. In: u_volume, R8, R16 or R16F, 3D, CLAMP_TO_EDGE, LINEAR or NEAREST, bricks of $PITCH texels;
//: u_bricks, RGBA8, 3D, a texel for each brick: its place and alpha 1, or alpha 0 and a 16-bit value. Slot value_near,
//: where gradients are taken: section near. It reads ghost voxels; a brick has at least one.
// The volume as bricks that hold the voxels at both ends of their cells.
uniform highp sampler3D u_volume;
uniform highp sampler3D u_bricks;
const vec3 LAST_VOXEL = $LAST_VOXEL;
const vec3 CELLS = $CELLS;
const vec3 LAST_BRICK = $LAST_BRICK;
const vec3 PITCH = $PITCH;
const vec3 POOL = $POOL;
float $STORED(vec3 at) {
  vec3 voxel = clamp(at - 0.5, vec3(0.0), LAST_VOXEL);
  vec3 brick = min(floor(voxel / CELLS), LAST_BRICK);
  vec4 entry = texelFetch(u_bricks, ivec3(brick), 0);
  if (entry.a < 0.5) {
    return dot(entry.rg, vec2(65280.0, 255.0)) / 65535.0;
  }
  // Division rounds: a position on the border may count as the other brick's, which holds its voxels as well.
  vec3 inside = clamp(voxel - brick * CELLS, vec3(0.0), CELLS);
  return textureLod(u_volume, (floor(entry.rgb * 255.0 + 0.5) * PITCH + inside + $FIRST_TEXEL) / POOL, 0.0).r;
}
//#part value_near
//#section near

// The value at a place at most a voxel beside another one, of whose brick it is: the next one may be left out.
float value_near(vec3 centre, vec3 at) {
  vec3 brick = min(floor(clamp(centre - 0.5, vec3(0.0), LAST_VOXEL) / CELLS), LAST_BRICK);
  vec4 entry = texelFetch(u_bricks, ivec3(brick), 0);
  if (entry.a < 0.5) {
    return dot(entry.rg, vec2(65280.0, 255.0)) / 65535.0;
  }
  vec3 inside = clamp(clamp(at - 0.5, vec3(0.0), LAST_VOXEL) - brick * CELLS, vec3(-1.0), CELLS + 1.0);
  return textureLod(u_volume, (floor(entry.rgb * 255.0 + 0.5) * PITCH + inside + $FIRST_TEXEL) / POOL, 0.0).r;
}
