//: Maximum intensity projection. Sections: about; start, before the loop; sample, in it, a piece of the ray in a cell;
//: picture. Slots: cells, from ray/cells.glsl; cubic and sampled, from cubic.glsl. The sampling gives stored_value, the
//: classification classify. No slot light: a maximum is at no one place.
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
greatest = max(greatest, greatest_of_cubic(values));
//#section picture
vec4 medium = classify(greatest);
// A ray that misses the box has no greatest value.
float opacity = count > 0.0 ? 1.0 - exp(-medium.a * REFERENCE_MM) : 0.0;
$PICTURE = vec4(medium.rgb * opacity, opacity);
