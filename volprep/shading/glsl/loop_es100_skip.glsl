//: As loop_es100, for rays that skip: opens two blocks, of which the end closes the outer one.
// GLSL ES 1.00 wants a constant bound: the longest ray at the finest step.
for (float turn = 0.5; turn < $MAX_STEPS; turn++) {
  if (next > count) {
    break;
  }
  //#part skip_look
  for (float k = 0.0; k < RUN; k++) {
    float i = first + k;
    if (i > count) {
      break;
    }
