//: GLSL ES 1.00. In: u_skip, LUMINANCE, 2D, LINEAR: a mosaic of the table, one texel a block. Constants: its layout.
// How far a ray may go without looking, for each block. The first and the last block also hold the outer half voxel.
uniform highp sampler2D u_skip;
const vec3 BLOCKS_PER_MM = $BLOCKS_PER_MM;
const float HALF_VOXEL = $HALF_VOXEL;
const vec3 LAST_BLOCK = $LAST_BLOCK;
const vec2 SKIP_TILE = $SKIP_TILE;
const vec2 SKIP_MOSAIC = $SKIP_MOSAIC;
const float SKIP_TILES_X = $SKIP_TILES_X;
vec3 block_offset(vec3 box_mm) {
  return box_mm * BLOCKS_PER_MM;
}
vec3 block_position(vec3 box_mm) {
  return block_offset(box_mm) - HALF_VOXEL;
}
float skip_entry(inout vec3 block, vec3 stride) {
  block = clamp(block, vec3(0.0), LAST_BLOCK);
  float slice = block.z;
  //#part skip_octant
  // At the centre of a texel the linear filter gives the texel itself.
  float row = floor((slice + 0.5) / SKIP_TILES_X);
  vec2 tile = vec2(slice - row * SKIP_TILES_X, row);
  return floor(texture2D(u_skip, (tile * SKIP_TILE + block.xy + 0.5) / SKIP_MOSAIC).r * 255.0 + 0.5);
}
