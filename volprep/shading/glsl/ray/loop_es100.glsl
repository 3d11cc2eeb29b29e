//: GLSL ES 1.00, appendix A: a loop counts from one constant to another. A float index holds 2^23 steps exactly, a
//: highp int need not hold more than 2^16. FIRST is the first sample, LAST ends them.
//#part lighting_run
// GLSL ES 1.00 wants a constant bound: the longest ray at the finest step.
for (float k = 0.0; k < $MAX_STEPS; k$NEXT) {
  float $I = $FROM + k;
  if ($I > $LAST) {
    break;
  }
  //#part turn
  //#part stop
}
