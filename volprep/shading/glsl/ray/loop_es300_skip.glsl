//: As loop_es300, for rays that skip: the outer loop looks at the table, the inner one takes a run of samples.
while (next < $LAST) {
  //#part look
  for (float i = run_start; i < min(next, $LAST); i++) {
    //#part sample
    //#part stop
  }
  //#part stop
}
