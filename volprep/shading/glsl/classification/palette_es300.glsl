//: GLSL ES 3.00, which may index constants by a computed number. $OF tells channels apart in a picture of several.
// The transfer function in $ENTRIES entries: rgb linear colour, a extinction per millimetre.
const vec4 PALETTE$OF[$ENTRIES] = vec4[$ENTRIES](
  //: One entry a line.
  $PALETTE
);
vec4 classify$OF(float stored) {
  return PALETTE$OF[int(stored * $LAST_ENTRY + 0.5)];
}
