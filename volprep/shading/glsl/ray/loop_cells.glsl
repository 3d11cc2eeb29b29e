//: Loops of rays that go from cell to cell, with cells.glsl. Sections: es300 and es100, the dialects; es300_skip and
//: es100_skip, for rays that skip: a run is of cells, and may end anywhere in a segment. Words and slots are those of
//: loop_es300, loop_es100 and their loops with skip; MAX_FACES is the most faces that any ray meets.
//#section es300
while (walked < $LAST) {
  //#part face
  //#part sample
  //#part passed
}
//#section es100
// GLSL ES 1.00 wants a constant bound: the faces of all cells.
for (float k = 0.0; k < $MAX_FACES; k++) {
  if (walked >= $LAST) {
    break;
  }
  //#part face
  //#part sample
  //#part passed
}
//#section es300_skip
while (next < $LAST + 0.5) {
  while (next < $LAST + 0.5) {
    //#part look
    break;
  }
  //#part enter
  for (float k = 0.0; k < RUN && walked < $LAST; k++) {
    //#part face
    //#part sample
    //#part passed
  }
  next = walked + 0.5;
}
//#section es100_skip
// GLSL ES 1.00 wants a constant bound: each turn passes a face of a cell, or jumps over one.
for (float turn = 0.0; turn < $MAX_FACES; turn++) {
  if (next >= $LAST + 0.5) {
    break;
  }
  //#part look
  //#part enter
  for (float k = 0.0; k < RUN; k++) {
    if (walked >= $LAST) {
      break;
    }
    //#part face
    //#part sample
    //#part passed
  }
  next = walked + 0.5;
}
