//: In: u_preintegrated, RGBA16F, N x N, LINEAR, CLAMP_TO_EDGE; s is the value at the front, t that at the back.
// The transfer function integrated over a segment between two normalised stored values: rgb colour of its light,
// linear; a mean extinction per millimetre.
uniform highp sampler2D u_preintegrated;
vec4 classify(float front, float back) {
  return $TEXTURE_2D(u_preintegrated, vec2(front, back) * $LOOKUP_SCALE + $LOOKUP_OFFSET);
}
