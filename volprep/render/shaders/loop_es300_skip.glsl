//: As loop_es300, for rays that skip.
for (float i = 0.5, next; i < count; i = next) {
  next = i + 1.0;
