//: In: pool_value, the value at a position in texels of the pool, whose bricks have $PITCH texels; brick_entry, the
//: entry of the brick at a position in bricks: its place and alpha 1, or alpha 0 and a 16-bit value. Slot pool is the
//: section texture3d, or the parts of two mosaics. Slot value_near, where gradients are taken: section near. It reads
//: ghost voxels; a brick has at least one.
// The volume as bricks that hold the voxels at both ends of their cells.
const vec3 LAST_VOXEL = $LAST_VOXEL;
const vec3 CELLS = $CELLS;
const vec3 LAST_BRICK = $LAST_BRICK;
const vec3 PITCH = $PITCH;
//#part pool
float $STORED(vec3 at) {
  vec3 voxel = clamp(at - 0.5, vec3(0.0), LAST_VOXEL);
  vec3 brick = min(floor(voxel / CELLS), LAST_BRICK);
  vec4 entry = brick_entry(brick + 0.5);
  if (entry.a < 0.5) {
    return dot(entry.rg, vec2(65280.0, 255.0)) / 65535.0;
  }
  // Division rounds: a position on the border may count as the other brick's, which holds its voxels as well.
  vec3 inside = clamp(voxel - brick * CELLS, vec3(0.0), CELLS);
  return pool_value(floor(entry.rgb * 255.0 + 0.5) * PITCH + inside + $FIRST_TEXEL);
}
//#part value_near
//#section texture3d
uniform highp sampler3D u_volume;
uniform highp sampler3D u_bricks;
const vec3 POOL = $POOL;
float pool_value(vec3 at) {
  return textureLod(u_volume, at / POOL, 0.0).r;
}
vec4 brick_entry(vec3 at) {
  return texelFetch(u_bricks, ivec3(at), 0);
}
//#section near

// The value at a place at most a voxel beside another one, of whose brick it is: the next one may be left out.
float value_near(vec3 centre, vec3 at) {
  vec3 brick = min(floor(clamp(centre - 0.5, vec3(0.0), LAST_VOXEL) / CELLS), LAST_BRICK);
  vec4 entry = brick_entry(brick + 0.5);
  if (entry.a < 0.5) {
    return dot(entry.rg, vec2(65280.0, 255.0)) / 65535.0;
  }
  vec3 inside = clamp(clamp(at - 0.5, vec3(0.0), LAST_VOXEL) - brick * CELLS, vec3(-1.0), CELLS + 1.0);
  return pool_value(floor(entry.rgb * 255.0 + 0.5) * PITCH + inside + $FIRST_TEXEL);
}
//#section on_demand
// Bricks of several levels, with ghost voxels on each side. The entry of each brick of level 0 is the place of the
// finest brick held there and 1 + its level in alpha, or alpha 0 and a 16-bit value.
const vec3 CELLS = $CELLS;
const vec3 LAST_BRICK = $LAST_BRICK;
const vec3 PITCH = $PITCH;
const vec3 FACTORS[$LEVELS] = vec3[]($FACTORS);
//#part pool
float $STORED(vec3 at) {
  vec3 brick = clamp(floor(at / CELLS), vec3(0.0), LAST_BRICK);
  vec4 entry = floor(brick_entry(brick + 0.5) * 255.0 + 0.5);
  if (entry.a < 0.5) {
    return dot(entry.rg, vec2(256.0, 1.0)) / 65535.0;
  }
  vec3 factor = FACTORS[int(entry.a) - 1];
  // Division rounds: a position on the border may count as the other brick's, whose ghost voxels serve it as well.
  vec3 inside = clamp(at / factor - floor((brick + 0.5) / factor) * CELLS, vec3(0.0), CELLS);
  return pool_value(entry.rgb * PITCH + inside + $FIRST_TEXEL);
}
//#part value_near
//#section on_demand_near

// The value at a place at most a voxel beside another one, of whose brick it is: the next one may be of another level.
float value_near(vec3 centre, vec3 at) {
  vec3 brick = clamp(floor(centre / CELLS), vec3(0.0), LAST_BRICK);
  vec4 entry = floor(brick_entry(brick + 0.5) * 255.0 + 0.5);
  if (entry.a < 0.5) {
    return dot(entry.rg, vec2(256.0, 1.0)) / 65535.0;
  }
  vec3 factor = FACTORS[int(entry.a) - 1];
  vec3 inside = clamp(at / factor - floor((brick + 0.5) / factor) * CELLS, vec3(-1.0), CELLS + 1.0);
  return pool_value(entry.rgb * PITCH + inside + $FIRST_TEXEL);
}
