//: The mean value along the ray. Sections: about; start, before the loop; sample, in it, the segment whose middle is i;
//: picture. The sampling gives stored_value, the classification classify. No slot light: a mean is at no one place.
//#section about
// The mean value along the pixel's ray, as the transfer function shows it with the opacity of REFERENCE_MM. Gives
// premultiplied linear light.
const float REFERENCE_MM = $REFERENCE_MM;
//#section start
float sum = 0.0;
//#section sample
sum += stored_value(start + stride * i);
//#section picture
vec4 medium = classify(sum / max(count, 1.0));
// A ray that misses the box has no mean.
float opacity = count > 0.0 ? 1.0 - exp(-medium.a * REFERENCE_MM) : 0.0;
$PICTURE = vec4(medium.rgb * opacity, opacity);
