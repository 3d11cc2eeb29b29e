//: A mosaic of one slice. Words: as those of slices_linear.glsl.
// The only slice: nothing changes along z.
vec4 $VOXEL(vec3 at) {
  return $TEXEL(0.0, at.xy);
}
