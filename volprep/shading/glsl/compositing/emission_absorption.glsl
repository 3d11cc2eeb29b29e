//: Emission and absorption (Max 1995). Sections: about; start, before the loop; sample, in it, the segment whose middle
//: is i; picture; and, where rays may end early, stop_start, stop and stop_picture. MEDIUM is the colour and the
//: extinction of the segment; slot light changes its colour.
//#section about
// The integral of colour * extinction * exp(-optical depth) along the pixel's ray, in equal segments of u_step_mm at
// most. Gives premultiplied linear light; alpha is the opacity.
//#section start
float segment_mm = length_mm / max(count, 1.0);
// Summing the depth and taking differences of exp(-depth) is front-to-back compositing with opacity
// 1 - exp(-extinction * segment), without rounding each faint segment to float32's 1 - 6e-8.
float depth = 0.0;
float transmittance = 1.0;
vec3 colour = vec3(0.0);
//#part stop_start
//#section sample
vec4 medium = $MEDIUM;
//#part within
//#part light
depth += medium.a * segment_mm;
float remaining = exp(-depth);
colour += medium.rgb * (transmittance - remaining);
transmittance = remaining;
//#section picture
//#part stop_picture
$PICTURE = vec4(colour, 1.0 - transmittance);
//#section stop_start
// A ray ends where light from behind adds at most this. With finer steps it is less, as their error is.
float least_transmittance = $LEAST_TRANSMITTANCE * pow(min(u_step_mm / $NOMINAL_STEP_MM, 1.0), 2.0);
//#section stop
if (transmittance < least_transmittance) {
  break;
}
//#section stop_picture
// The volume behind the end of the ray looks like the volume before it.
if (transmittance < least_transmittance) {
  colour /= 1.0 - transmittance;
  transmittance = 0.0;
}
