//: A ray cell by cell: from each face of a cell between eight voxels to the next (Amanatides and Woo 1987), for
//: compositings that need the field of whole cells. Both dialects. Words: VOXEL of the sampling; FIRST_CELL, where the
//: first segment begins. Sections: declared; start, before the loop; face and passed, around what is made of a piece of
//: the ray, which is from `walked`, with the value `front`, to `reached`, with the value `back`; enter, behind empty
//: space. A piece is the same, to the last bit, wherever a ray begins: rays that skip draw the same picture.
//#section declared
// The place on the ray where it enters the cell behind these faces, in segments.
float entered_cell(vec3 faces, vec3 cell_start, vec3 per_face) {
  vec3 passed = (faces - cell_start) * per_face;
  return max(max(passed.x, passed.y), max(passed.z, 0.0));
}
//#section start
// Positions in cells, whose faces are at whole numbers; along each axis the ray runs towards greater ones. A cell is
// one voxel wide, or as many as a segment is long if that is more than one and a half.
vec3 voxel = $VOXEL;
vec3 cell = voxel * max(floor(length(stride / voxel) + 0.5), 1.0);
vec3 towards = mix(vec3(-1.0), vec3(1.0), step(0.0, stride));
vec3 cell_start = towards * (start - 0.5 * voxel) / cell;
// Along an axis that the ray does not move on, it meets no face: a slope of 1e-7 instead of none.
vec3 cell_stride = max(abs(stride / cell), 1e-7 * length(stride / cell) + 1e-30);
vec3 per_face = 1.0 / cell_stride;
vec3 faces = floor($FIRST_CELL);
float walked = entered_cell(faces, cell_start, per_face);
float front = stored_value(start + stride * walked);
//#section face
vec3 ahead = (faces + 1.0 - cell_start) * per_face;
float reached = min(min(ahead.x, ahead.y), min(ahead.z, count));
float back = stored_value(start + stride * reached);
//#section passed
faces += step(ahead, vec3(reached));
walked = reached;
front = back;
//#section enter
if (walked < next - 0.5) {
  faces = floor(cell_start + cell_stride * (next - 0.5));
  walked = entered_cell(faces, cell_start, per_face);
  front = stored_value(start + stride * walked);
}
