//: GLSL ES 1.00. In: u_volume, LUMINANCE or RGBA, 8 bits, 2D, LINEAR, CLAMP_TO_EDGE, at most 4096 texels wide: float32
//: places a texel's centre to 2^-11 of a texel there. Constants: the layout of one mosaic.
// The volume as a mosaic: normalised stored values, 0 to 1, in tiles of one slice and channel each. Positions are in
// voxels; the centre of voxel k is at k + 0.5.
uniform highp sampler2D u_volume;
const vec3 VOXELS_PER_MM = $VOXELS_PER_MM;
const vec2 TILE = $TILE;
const vec2 MOSAIC = $MOSAIC;
const float TILES_X = $TILES_X;
vec3 position(vec3 box_mm) {
  return box_mm * VOXELS_PER_MM;
}
vec4 tile_texel(float tile, vec2 at) {
  // Half a tile away from the rounding of an exact quotient.
  float row = floor((tile + 0.5) / TILES_X);
  float column = tile - row * TILES_X;
  // Half a texel inside the tile, so that the linear filter never reaches a neighbour.
  return texture2D(u_volume, (vec2(column, row) * TILE + clamp(at, vec2(0.5), TILE - 0.5)) / MOSAIC);
}
