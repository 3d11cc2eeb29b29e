//: Normals from the volume itself. Sections: central; central_of_levels, with FINEST_VOXEL_MM, the size of a voxel of
//: level 0; forward. The sampling gives stored_value, the size of a voxel in positions, the end of the last voxel, the
//: number of positions per millimetre, and NEAR, which reads the volume beside `centre`; AROUND is its first argument.
//: $OF tells media apart in a picture of several.
//#section central
// The gradient of the normalised stored values, per millimetre, from samples one voxel before and behind.
vec3 normal_at$OF(vec3 at) {
  vec3 voxel = $VOXEL;
  // In the outer half voxels nothing changes.
  vec3 centre = clamp(at, 0.5 * voxel, $LAST_POSITION - 0.5 * voxel);
  vec3 x = vec3(voxel.x, 0.0, 0.0);
  vec3 y = vec3(0.0, voxel.y, 0.0);
  vec3 z = vec3(0.0, 0.0, voxel.z);
  vec3 before = vec3(${NEAR}(${AROUND}centre - x), ${NEAR}(${AROUND}centre - y), ${NEAR}(${AROUND}centre - z));
  vec3 behind = vec3(${NEAR}(${AROUND}centre + x), ${NEAR}(${AROUND}centre + y), ${NEAR}(${AROUND}centre + z));
  return (behind - before) * (0.5 * $POSITION_PER_MM / voxel);
}
//#section central_of_levels
// Size of a voxel of level 0.
const vec3 FINEST_VOXEL_MM$OF = $FINEST_VOXEL_MM;
// The gradient of the normalised stored values, per millimetre, from samples half a voxel before and behind, but at
// least a voxel of level 0. The mean gradient over a voxel is the difference between its faces.
vec3 normal_at$OF(vec3 at) {
  vec3 voxel = $VOXEL;
  // In the outer half voxels nothing changes.
  vec3 centre = clamp(at, 0.5 * voxel, $LAST_POSITION - 0.5 * voxel);
  vec3 apart = max(0.5 * voxel, FINEST_VOXEL_MM$OF * $POSITION_PER_MM);
  vec3 x = vec3(apart.x, 0.0, 0.0);
  vec3 y = vec3(0.0, apart.y, 0.0);
  vec3 z = vec3(0.0, 0.0, apart.z);
  vec3 before = vec3(${NEAR}(${AROUND}centre - x), ${NEAR}(${AROUND}centre - y), ${NEAR}(${AROUND}centre - z));
  vec3 behind = vec3(${NEAR}(${AROUND}centre + x), ${NEAR}(${AROUND}centre + y), ${NEAR}(${AROUND}centre + z));
  return (behind - before) * (0.5 * $POSITION_PER_MM / apart);
}
//#section forward
// The gradient of the normalised stored values, per millimetre, from samples here and one voxel behind.
vec3 normal_at$OF(vec3 at) {
  vec3 voxel = $VOXEL;
  // In the outer half voxels nothing changes.
  vec3 centre = clamp(at, 0.5 * voxel, $LAST_POSITION - 0.5 * voxel);
  vec3 x = vec3(voxel.x, 0.0, 0.0);
  vec3 y = vec3(0.0, voxel.y, 0.0);
  vec3 z = vec3(0.0, 0.0, voxel.z);
  vec3 behind = vec3(${NEAR}(${AROUND}centre + x), ${NEAR}(${AROUND}centre + y), ${NEAR}(${AROUND}centre + z));
  return (behind - stored_value$OF(centre)) * ($POSITION_PER_MM / voxel);
}
