//: As loop_es300, for rays that skip. Pixels are drawn in groups, whose rays wait for each other: all jump first, as
//: often as each must, and then all take a run of samples. If each ray took its own next step instead, a group
//: would take a run for each jump and each run: a tenth to a sixth of the time (tests/benchmarks/bench_vtk.py).
while (next < $LAST$GOING) {
  while (next < $LAST) {
    //#part look
    break;
  }
  //#part run
  //#part lighting_run
  for (float $I = run_start; $I < min(next, $LAST)$GOING; $I$NEXT) {
    //#part turn
  }
}
