//: In: u_preintegrated, RGBA16F, N x N, LINEAR, CLAMP_TO_EDGE; s is the value at the front, t that at the back. Section
//: start: before the loop.
// The transfer function integrated over a segment between two normalised stored values: rgb colour of its light,
// linear, times a; a mean extinction per millimetre. The back becomes the front of the next segment.
uniform highp sampler2D u_preintegrated;
vec4 classify(inout float front, float back) {
  vec4 entry = $TEXTURE_2D(u_preintegrated, vec2(front, back) * $LOOKUP_SCALE + $LOOKUP_OFFSET);
  front = back;
  return vec4(entry.rgb / max(entry.a, 1e-9), entry.a);
}
//#section start
// The value at the front of the first segment.
float front = stored_value($FIRST_FRONT);
