//: Where a segment passes the isovalue, for isosurface and first hit. Both dialects. Section
//: start: before the loop.
// Where the value passes ISOVALUE between two positions on both sides of it: bisection to 1/64 of the segment, and
// there a straight line between the values.
vec3 passed_between(vec3 front, vec3 back) {
  bool begins_below = stored_value(front) < ISOVALUE;
  for (int k = 0; k < 6; k++) {
    vec3 middle = 0.5 * (front + back);
    if ((stored_value(middle) < ISOVALUE) == begins_below) {
      front = middle;
    } else {
      back = middle;
    }
  }
  float first = stored_value(front);
  float last = stored_value(back);
  return mix(front, back, (ISOVALUE - first) / (last - first));
}
//#section start
// The value at the front of the first segment.
float front = stored_value($FIRST_FRONT);
