//: GLSL ES 3.00, which indexes constants by what is computed.
// The transfer function in $ENTRIES entries: rgb linear colour, a extinction per millimetre.
const vec4 PALETTE[$ENTRIES] = vec4[$ENTRIES](
  $PALETTE
);
vec4 classify(float stored) {
  return PALETTE[int(stored * $LAST_ENTRY + 0.5)];
}
