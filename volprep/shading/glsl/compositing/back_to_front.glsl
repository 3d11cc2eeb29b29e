//: Emission and absorption, summed from the far end (Porter and Duff 1984: over). Sections: about; start, before the
//: loop; sample, in it, the segment whose middle is i; picture. MEDIUM is the colour and the extinction of the segment;
//: slot light changes its colour. No section stop: the front comes last.
//#section about
// The integral of colour * extinction * exp(-optical depth) along the pixel's ray, in equal segments of u_step_mm at
// most, each laid over the picture behind it. Gives premultiplied linear light; alpha is the opacity.
//#section start
float segment_mm = length_mm / max(count, 1.0);
float transmittance = 1.0;
vec3 colour = vec3(0.0);
//#section sample
vec4 medium = $MEDIUM;
//#part within
//#part light
float kept = exp(-medium.a * segment_mm);
colour = mix(medium.rgb, colour, kept);
transmittance *= kept;
//#section picture
$PICTURE = vec4(colour, 1.0 - transmittance);
