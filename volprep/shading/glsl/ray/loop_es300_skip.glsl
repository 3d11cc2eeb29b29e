//: As loop_es300, for rays that skip. Pixels are drawn in groups, whose rays wait for each other: all jump first, as
//: often as each must, and then all take a run of samples. If each ray took its own next step instead, a group
//: would take a run for each jump and each run: a tenth to a sixth of the time (tests/benchmarks/bench_vtk.py).
while (next < $LAST$GOING) {
  while (next < $LAST) {
    //#part look
    break;
  }
  float run_start = next;
  next += RUN;
  //#part lighting_run
  for (float i = run_start; i < min(next, $LAST)$GOING; i++) {
    //#part sample
  }
}
