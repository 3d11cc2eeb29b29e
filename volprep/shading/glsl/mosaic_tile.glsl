//: GLSL ES 1.00. In: one or several textures, LUMINANCE or RGBA, 8 bits, 2D, CLAMP_TO_EDGE, at most 4096 texels
//: wide: float32 places a texel's centre to 2^-11 of a texel there. Constants: the layout of one mosaic.
//: Slots: units declares the samplers; unit leaves the number of the texture in `unit`, and the tile's in it in `tile`;
//: inside gives the place in the texture, in texels; fetch reads it.
// The volume as a mosaic: normalised stored values, 0 to 1, in tiles of one slice and channel each. Positions are in
// voxels; the centre of voxel k is at k + 0.5.
//#part units
const vec3 VOXELS_PER_MM = $VOXELS_PER_MM;
const vec2 PITCH = $PITCH;
const vec2 MOSAIC = $MOSAIC;
const float TILES_X = $TILES_X;
vec3 position(vec3 box_mm) {
  return box_mm * VOXELS_PER_MM;
}
vec4 tile_texel(float tile, vec2 at) {
  //#part unit
  // Half a tile away from the rounding of an exact quotient.
  float row = floor((tile + 0.5) / TILES_X);
  float column = tile - row * TILES_X;
  //#part inside
  //#part fetch
}
