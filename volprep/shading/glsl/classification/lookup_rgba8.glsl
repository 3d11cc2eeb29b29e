//: In: u_transfer, RGBA8, one row, LINEAR, CLAMP_TO_EDGE; entry j of N is at the stored value j / (N - 1). $OF tells
//: channels apart in a picture of several.
// The transfer function over normalised stored values: rgb linear colour, a the square root of extinction / maximum.
uniform highp sampler2D u_transfer$OF;
const float MAX_EXTINCTION_PER_MM$OF = $MAX_EXTINCTION_PER_MM;
vec4 classify$OF(float stored) {
  vec4 entry = $TEXTURE_2D(u_transfer$OF, vec2(stored * $LOOKUP_SCALE + $LOOKUP_OFFSET, 0.5));
  return vec4(entry.rgb, MAX_EXTINCTION_PER_MM$OF * entry.a * entry.a);
}
