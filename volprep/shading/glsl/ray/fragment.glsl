//: Fragment shader of all ray casters, both dialects, highp throughout. In: the ends of the pixel's ray, homogeneous
//: box millimetres. Out: RGBA, premultiplied linear light, 0 to 1. Slots before main: dialect; rays; steps, what
//: `count` needs; sampling gives position(millimetres) and reads the volume at a position; classification makes
//: (linear colour, extinction per millimetre) of it; box gives clip_to_box, where the ray is cut by arithmetic;
//: skipping and lighting, where the package has them; about describes the picture. Slots in main: rays_ends;
//: inside, the fractions of the ray where it enters and leaves the box; cut, if only a part of the box is drawn,
//: leaves that part of the ray in `inside`; count, the number of samples, and their length; compositing_start;
//: rays_start finds the first sample, and the last; classification_start; skipping_start; lighting_start; loop takes
//: the samples; picture writes the result.
//#part dialect
//#part rays
//#part steps

//#part sampling

//#part classification

//#part box

//#part skipping

//#part lighting

//#part about
void main() {
  //#part rays_ends
  vec3 origin = $NEAR_END.xyz / $NEAR_END.w;
  vec3 ray = $FAR_END.xyz / $FAR_END.w - origin;
  //#part inside
  //#part cut
  float part = max(inside.y - inside.x, 0.0);
  //#part count
  // A sample is the middle of a segment: at start + stride * i, with i = 0.5, 1.5, ... below count.
  vec3 start = position(origin + ray * inside.x);
  vec3 stride = position(ray * (part / max(count, 1.0)));

  //#part compositing_start
  //#part rays_start
  //#part classification_start
  //#part skipping_start
  //#part lighting_start
  //#part loop
  //#part picture
}
