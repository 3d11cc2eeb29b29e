//: Arithmetic, no texture. $OF tells channels apart in a picture of several. Words: FIRST, the first control point;
//: NEXT, a line for each of the others.
// The transfer function from control point to control point, over normalised stored values: rgb linear colour, a
// extinction per millimetre.
vec4 classify$OF(float stored) {
  vec4 medium = $FIRST;
  $NEXT
  return medium;
}
