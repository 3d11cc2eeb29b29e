//: The first place where the value is ISOVALUE or more. Sections: about; start, before the loop; sample, in it, the
//: segment whose middle is i; stop, where the ray ends; picture. Of a segment both ends are sampled; `front` is the
//: value at its first one, from refinement.glsl. Slots: touch; and, where its place counts, refinement; hit, the
//: section hit; light, which changes the colour of `medium` at the place `hit`.
//#section about
// The first place on the pixel's ray where the value is ISOVALUE or more, as the transfer function shows the value
// there, with the opacity of REFERENCE_MM. Gives premultiplied linear light.
const float ISOVALUE = $ISOVALUE;
const float REFERENCE_MM = $REFERENCE_MM;
//#part touch

//#part refinement
//#section start
// The segment in which the ray meets the surface, and a place in it that is behind; none so far.
float passed = 0.0;
float behind = 0.0;
//#section sample
float back = stored_value(start + stride * (i + 0.5));
if (max(front, back) >= ISOVALUE) {
  passed = i;
  behind = i + 0.5;
} else {
  // As steep as it is here, the value may pass and come back between the samples.
  bool is_near = ISOVALUE - max(front, back) < abs(front - before) + abs(back - front);
  behind = touched(start, stride, i, true, is_near ? 7 : 0);
  passed = behind > 0.0 ? i : 0.0;
}
before = front;
front = back;
//#section stop
if (passed > 0.0) {
  break;
}
//#section picture
$PICTURE = vec4(0.0);
if (passed > 0.0) {
  //#part hit
  // Only where the box cuts a solid is the value at the segment's front more than ISOVALUE.
  float shown_value = max(stored_value(start + stride * (passed - 0.5)), ISOVALUE);
  vec4 medium = $SHOWN;
  //#part light
  float opacity = 1.0 - exp(-medium.a * REFERENCE_MM);
  $PICTURE = vec4(medium.rgb * opacity, opacity);
}
//#section hit
vec3 hit = start + stride * (passed - 0.5);
if (stored_value(hit) < ISOVALUE) {
  hit = passed_between(hit, start + stride * behind);
}
