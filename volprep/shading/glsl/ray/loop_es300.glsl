//: GLSL ES 3.00: a loop may end where the ray does. FIRST is the first sample.
for (float i = $FIRST; i < count; i++) {
  //#part sample
  //#part stop
}
