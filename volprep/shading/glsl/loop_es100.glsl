//: GLSL ES 1.00, appendix A: a loop counts from one constant to another. A float index holds 2^23 steps exactly, a
//: highp int need not hold more than 2^16.
// GLSL ES 1.00 wants a constant bound: the longest ray at the finest step.
for (float i = 0.5; i < $MAX_STEPS; i++) {
  if (i > count) {
    break;
  }
