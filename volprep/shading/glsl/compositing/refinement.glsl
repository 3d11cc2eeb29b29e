//: Where a ray passes the isovalue, for isosurface and first hit. Both dialects. Sections: touch, what finds a surface
//: between two samples; between, the place in a segment, where it is lit; start, before the loop; restart, behind empty
//: space. The search is a loop that may have no turn: an `if` costs drivers that take both branches seven fetches for
//: each sample.
//#section touch
// Looks for the other side of ISOVALUE in the segment in the middle of i, whose ends are on one side of it: golden
// section search for the value that comes nearest, in so many turns, 7 at most. Gives a place on the other side, in
// segments; 0 if it finds none.
float touched(vec3 start, vec3 stride, float i, bool is_below, int turns) {
  float low = i - 0.5;
  float high = i + 0.5;
  float best = i;
  float nearest = -2.0;
  for (int k = 0; k < 7; k++) {
    if (k >= turns) {
      break;
    }
    float at = k > 0 ? mix(best, high - best > best - low ? high : low, 0.381966) : i;
    float value = stored_value(start + stride * at);
    if ((value < ISOVALUE) != is_below) {
      return at;
    }
    float nearness = is_below ? value : -value;
    float end = nearness > nearest ? best : at;
    low = k > 0 && (at > best) == (nearness > nearest) ? end : low;
    high = k > 0 && (at > best) != (nearness > nearest) ? end : high;
    best = nearness > nearest ? at : best;
    nearest = max(nearness, nearest);
  }
  return 0.0;
}
//#section between
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
// The value at the front of the first segment, and of the one before it.
float front = stored_value($FIRST_FRONT);
float before = front;
//#section restart
before = stored_value(start + stride * (next - 1.5));
