//: GLSL ES 1.00. In: u_skip, LUMINANCE, 2D, LINEAR: one texel a block. Slot skip_texels: the mosaic, which gives
//: skip_texel.
//#part skip_texels

// How far a ray may go without looking, for each block. The first and the last block also hold the outer half voxel.
const vec3 BLOCKS_PER_MM = $BLOCKS_PER_MM;
const float HALF_VOXEL = $HALF_VOXEL;
const vec3 LAST_BLOCK = $LAST_BLOCK;
vec3 block_offset(vec3 box_mm) {
  return box_mm * BLOCKS_PER_MM;
}
vec3 block_position(vec3 box_mm) {
  return block_offset(box_mm) - HALF_VOXEL;
}
float skip_entry(inout vec3 block) {
  block = clamp(block, vec3(0.0), LAST_BLOCK);
  return floor(skip_texel(block.z, block.xy + 0.5).r * 255.0 + 0.5);
}
