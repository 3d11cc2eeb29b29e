//: Emission and absorption (Max 1995). Sections: about; start, before the loop; sample, in it, the segment whose middle
//: is i; stop, where a ray may end early; picture. MEDIUM is the colour and the extinction of the segment; slot light
//: changes its colour.
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
//#section sample
vec4 medium = $MEDIUM;
//#part light
depth += medium.a * segment_mm;
float remaining = exp(-depth);
colour += medium.rgb * (transmittance - remaining);
transmittance = remaining;
//#section stop
// What is behind adds at most what is left.
if (transmittance < $LEAST_TRANSMITTANCE) {
  break;
}
//#section picture
$PICTURE = vec4(colour, 1.0 - transmittance);
