//: GLSL ES 3.00. In: u_skip, R8, 3D, one texel a block; u_blocks_from_box, per millimetre. Constant: half a voxel in
//: blocks. Section entries: the table u_skip$OF alone.
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
float skip_entry$OF(inout vec3 block) {
  ivec3 blocks = textureSize(u_skip$OF, 0);
  block = clamp(block, vec3(0.0), vec3(blocks - 1));
  return floor(texelFetch(u_skip$OF, ivec3(block), 0).r * 255.0 + 0.5);
}
