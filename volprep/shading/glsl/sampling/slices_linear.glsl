//: A mosaic with one slice in a texel: two fetches for each sample. Words: as mosaic.glsl has; VOXEL, the function.
const float ${P}LAST_SLICE = $LAST_SLICE;
vec4 $VOXEL(vec3 at) {
  float slice = clamp(at.z - 0.5, 0.0, ${P}LAST_SLICE);
  float lower = floor(slice);
  // At the last slice the one above it has weight 0.
  return mix($TEXEL(lower, at.xy), $TEXEL(lower + 1.0, at.xy), slice - lower);
}
