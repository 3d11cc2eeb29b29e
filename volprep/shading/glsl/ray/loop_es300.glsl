//: GLSL ES 3.00: a loop may end where the ray does. FIRST is the first sample, LAST ends them.
for (float i = $FIRST; i < $LAST; i++) {
  //#part sample
  //#part stop
}
