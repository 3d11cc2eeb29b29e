//: GLSL ES 1.00, which cannot index constants by a computed number. $OF tells channels apart in a picture of several.
//: Words: FIRST, the first entry; NEXT, a line for each of the others.
// The transfer function in $ENTRIES entries: rgb linear colour, a extinction per millimetre.
vec4 classify$OF(float stored) {
  float entry = floor(stored * $LAST_ENTRY + 0.5);
  vec4 medium = $FIRST;
  $NEXT
  return medium;
}
