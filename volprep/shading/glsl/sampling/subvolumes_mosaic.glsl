//: GLSL ES 1.00. In: the pieces around a point of the grid as eight textures of a mosaic, one piece in each. Slices are
//: numbered through all of them, and block_value reads them. A piece that does not exist is never reached: u_split lies
//: outside the volume there. Where voxels have labels, in the components after the value: section labels. Words:
//: SLICES, the slices of a texture; STORED, the function.
// Level 0 as up to eight pieces that share a layer of voxels with their neighbours. They fill the box from u_box_low_mm
// to u_box_high_mm.
uniform vec3 u_split;
uniform vec3 u_low_start;
uniform vec3 u_low_size;
uniform vec3 u_high_start;
uniform vec3 u_high_size;
uniform vec3 u_box_low_mm;
uniform vec3 u_box_high_mm;
const float SLICES_OF_PIECE = $SLICES;
float $STORED(vec3 at) {
  vec3 upper = step(u_split, at);
  vec3 inside = at - mix(u_low_start, u_high_start, upper);
  // Half a voxel inside the piece, so that the filter reaches no other tile, and no slice of another piece.
  inside = clamp(inside, vec3(0.5), mix(u_low_size, u_high_size, upper) - 0.5);
  inside.z += dot(upper, vec3(1.0, 2.0, 4.0)) * SLICES_OF_PIECE;
  return block_value(inside);
}
//#section labels
// Value and label of a voxel, bytes, from the piece that begins at it, or holds it; 1/4096 as in subvolumes.glsl.
vec4 label_texel(vec3 at) {
  vec3 upper = step(u_split, at);
  vec3 inside = at - mix(u_low_start, u_high_start, upper);
  inside = clamp(inside, vec3(0.5), mix(u_low_size, u_high_size, upper) - 0.5);
  float slice = floor(inside.z) + dot(upper, vec3(1.0, 2.0, 4.0)) * SLICES_OF_PIECE;
  return floor(tile_texel(slice, inside.xy + 1.0 / 4096.0) * 255.0 + 0.5);
}
