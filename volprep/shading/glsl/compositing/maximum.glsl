//: Maximum intensity projection. Sections: about; start, before the loop; sample, in it, a piece of the ray in a cell;
//: picture. Slots: cells, from ray/cells.glsl; cubic and sampled, from cubic.glsl. The sampling gives stored_value, the
//: classification $SHOWN. Sections start_placed and sample_placed keep the place of the maximum.
//#section about
// The greatest value along the pixel's ray, as the transfer function shows it with the opacity of REFERENCE_MM. Gives
// premultiplied linear light.
const float REFERENCE_MM = $REFERENCE_MM;
//#part cells

//#part cubic
//#section start
float greatest = 0.0;
//#section sample
//#part sampled
greatest = max(greatest, greatest_of_cubic(values).x);
//#section start_placed
float greatest = -1.0;
// The place on the ray whose labels count, in segments, and the value there.
float greatest_at = 0.0;
float value_there = -1.0;
//#section sample_placed
//#part sampled
vec2 found = greatest_of_cubic(values);
greatest = max(greatest, found.x);
// Of values that hardly differ the first place counts.
if (found.x > value_there + $SAME) {
  value_there = found.x;
  greatest_at = mix(walked, reached, found.y);
}
//#section picture
vec4 medium = $SHOWN;
// A ray that misses the box has no greatest value.
float opacity = $HAS_GREATEST ? 1.0 - exp(-medium.a * REFERENCE_MM) : 0.0;
$PICTURE = vec4(medium.rgb * opacity, opacity);
