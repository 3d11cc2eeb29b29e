//: In: a texel of the volume, rgb linear colour times opacity, a opacity of a path of REFERENCE_MM.
// Voxels are classified already: gives their colour, and extinction per millimetre. 255 means opacities above
// 254.5 / 255, with the middle 1 - 1 / 512.
const float REFERENCE_MM = $REFERENCE_MM;
vec4 classify(vec4 texel) {
  float opacity = min(texel.a, 1.0 - 1.0 / 512.0);
  return vec4(texel.rgb / max(texel.a, 1.0 / 512.0), -log(1.0 - opacity) / REFERENCE_MM);
}
