// GLSL ES 1.00 wants a constant bound: the longest ray at the finest step.
for (float i = 0.5; i < $MAX_STEPS; i++) {
  if (i > count) {
    break;
  }
