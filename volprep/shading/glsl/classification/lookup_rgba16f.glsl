//: In: u_transfer, RGBA16F, one row, LINEAR, CLAMP_TO_EDGE; entry j of N is at the stored value j / (N - 1). $OF tells
//: channels apart in a picture of several.
// The transfer function over normalised stored values: rgb linear colour, a extinction per millimetre.
uniform highp sampler2D u_transfer$OF;
vec4 classify$OF(float stored) {
  return $TEXTURE_2D(u_transfer$OF, vec2(stored * $LOOKUP_SCALE + $LOOKUP_OFFSET, 0.5));
}
