//: A mosaic with one slice in a texel whose values must not be mixed: one fetch for each sample. Words: as in
//: slices_linear.glsl.
const float ${P}LAST_SLICE = $LAST_SLICE;
// The voxel that the position is in.
vec4 $VOXEL(vec3 at) {
  return $TEXEL(clamp(floor(at.z), 0.0, ${P}LAST_SLICE), at.xy);
}
