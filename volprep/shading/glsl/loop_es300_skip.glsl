//: As loop_es300, for rays that skip: opens two blocks, of which the end closes the outer one.
while (next < count) {
  //#part skip_look
  for (float i = first; i < min(next, count); i++) {
