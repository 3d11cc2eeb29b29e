//: Minimum intensity projection. Sections: about; start, before the loop; sample, in it, a piece of the ray in a cell;
//: picture. Slots: cells, from ray/cells.glsl; cubic and sampled, from cubic.glsl. The sampling gives stored_value, the
//: classification classify. No slot light: a minimum is at no one place.
//#section about
// The least value along the pixel's ray, as the transfer function shows it with the opacity of REFERENCE_MM. Gives
// premultiplied linear light.
const float REFERENCE_MM = $REFERENCE_MM;
//#part cells

//#part cubic
//#section start
float least = 1.0;
//#section sample
//#part sampled
least = min(least, -greatest_of_cubic(-values).x);
//#section picture
vec4 medium = classify(least);
// A ray that misses the box has no least value.
float opacity = count > 0.0 ? 1.0 - exp(-medium.a * REFERENCE_MM) : 0.0;
$PICTURE = vec4(medium.rgb * opacity, opacity);
