//: As loop_es100, for rays that skip: the next sample is a variable of its own, because the index may not be changed.
// GLSL ES 1.00 wants a constant bound: the longest ray at the finest step.
float next = 0.5;
for (float turn = 0.5; turn < $MAX_STEPS; turn++) {
  float i = next;
  if (i > count) {
    break;
  }
  next = i + 1.0;
