//: As loop_es100, for rays that begin at proxy geometry.
// GLSL ES 1.00 wants a constant bound: the longest ray at the finest step.
for (float k = 0.0; k < $MAX_STEPS; k++) {
  float i = $FIRST + k;
  if (i > count) {
    break;
  }
