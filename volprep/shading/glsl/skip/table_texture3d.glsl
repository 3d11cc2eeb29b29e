//: GLSL ES 3.00. In: u_skip, R8, 3D, one texel a block; u_blocks_from_box, per millimetre. Constant: half a voxel in
//: blocks. Section entries: the table u_skip$OF alone; its slot skip_octant, where the table has a part for each octant
//: of directions: section octant.
//#part skip_entries

uniform vec3 u_blocks_from_box;
const float HALF_VOXEL = $HALF_VOXEL;
vec3 block_offset(vec3 box_mm) {
  return box_mm * u_blocks_from_box;
}
vec3 block_position(vec3 box_mm) {
  return block_offset(box_mm) - HALF_VOXEL;
}
//#section entries
// How far a ray may go without looking, for each block. The first and the last block also hold the outer half voxel.
uniform highp sampler3D u_skip$OF;
float skip_entry$OF(inout vec3 block, vec3 stride) {
  ivec3 blocks = textureSize(u_skip$OF, 0)$OCTANT_TABLES;
  block = clamp(block, vec3(0.0), vec3(blocks - 1));
  ivec3 texel = ivec3(block);
  //#part skip_octant
  return floor(texelFetch(u_skip$OF, texel, 0).r * 255.0 + 0.5);
}
//#section octant
// The tables of the octants lie one after the other: 1 towards smaller x, 2 smaller y, 4 smaller z.
ivec3 smaller = ivec3(lessThan(stride, vec3(0.0)));
texel.z += blocks.z * (smaller.x + 2 * smaller.y + 4 * smaller.z);
