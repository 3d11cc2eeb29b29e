//: GLSL ES 3.00: a loop may end where the ray does. FIRST is the first sample; LAST ends the loop, and so does a
//: false GOING. Drivers that draw pixels in groups leave a loop by its condition faster than by a break, which takes a
//: seventh of the time of a picture (tests/benchmarks/bench_vtk.py). Slot turn takes the samples of one; words: I, the
//: first of them; NEXT goes on to that of the next turn; FROM, where they begin: groups.glsl.
//#part lighting_run
for (float $I = $FROM; $I < $LAST$GOING; $I$NEXT) {
  //#part turn
}
