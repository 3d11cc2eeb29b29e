//: As loop_es100, for rays that skip: the outer loop looks at the table, the inner one takes a run of samples.
// GLSL ES 1.00 wants a constant bound: the longest ray at the finest step.
for (float turn = 0.0; turn < $MAX_STEPS; turn++) {
  if (next > $LAST) {
    break;
  }
  //#part look
  //#part run
  //#part lighting_run
  for (float k = 0.0; k < RUN; k$NEXT) {
    float $I = run_start + k;
    if ($I > $LAST) {
      break;
    }
    //#part turn
    //#part stop
  }
  //#part stop
}
