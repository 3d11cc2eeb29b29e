//: Positions for everything that lies in voxels: mosaics, bricks, sub-volumes.
// Positions are in voxels: the centre of voxel k is at k + 0.5.
const vec3 VOXELS_PER_MM = $VOXELS_PER_MM;
vec3 position(vec3 box_mm) {
  return box_mm * VOXELS_PER_MM;
}
