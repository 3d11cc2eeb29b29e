//: GLSL ES 1.00. In: u_skip, LUMINANCE, 2D, LINEAR: one texel a block. Slots: skip_texels is the mosaic, which gives
//: skip_texel; skip_octant, where the table has one part for each octant of directions: section octant.
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
float skip_entry(inout vec3 block, vec3 stride) {
  block = clamp(block, vec3(0.0), LAST_BLOCK);
  float slice = block.z;
  //#part skip_octant
  return floor(skip_texel(slice, block.xy + 0.5).r * 255.0 + 0.5);
}
//#section octant
// The tables of the octants lie one after the other: 1 towards smaller x, 2 smaller y, 4 smaller z.
slice += (LAST_BLOCK.z + 1.0) * dot(vec3(lessThan(stride, vec3(0.0))), vec3(1.0, 2.0, 4.0));
