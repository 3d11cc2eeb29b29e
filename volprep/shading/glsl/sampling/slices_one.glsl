//: A mosaic of one slice. Words: as in slices_linear.glsl.
// The only slice: nothing changes along z.
vec4 $VOXEL(vec3 at) {
  return $TEXEL(0.0, at.xy);
}
