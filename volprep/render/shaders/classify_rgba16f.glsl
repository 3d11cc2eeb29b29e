// The transfer function over normalised stored values: rgb linear colour, a extinction per millimetre.
uniform highp sampler2D u_transfer;
vec4 classify(float stored) {
  return $TEXTURE_2D(u_transfer, vec2(stored * $LOOKUP_SCALE + $LOOKUP_OFFSET, 0.5));
}
