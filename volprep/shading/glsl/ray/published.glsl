//: Ray casting as the mobile volume rendering thesis (appendix: STEPS) and Schultz and Bailey (appendix B: MAX_ALPHA)
//: have it. Sections: count; and about, start, sample and picture, as compositing/emission_absorption.glsl has them.
//#section count
float length_mm = part * length(ray);
// A short ray has the same number of samples as the longest.
float steps = $LONGEST_MM / u_step_mm;
float count = length_mm > 0.0 ? ceil(max(steps - 0.001, min(steps, 0.001))) : 0.0;
//#section about
// Samples blended front to back as published: each has the same opacity, whatever its distance from the next one. Gives
// premultiplied linear light; alpha is the opacity.
//#section start
float transmittance = 1.0;
vec3 colour = vec3(0.0);
//#part stop_start
//#section sample
vec4 medium = $MEDIUM;
//#part within
//#part light
float opacity = 1.0 - exp(-medium.a * $REFERENCE_MM);
colour += medium.rgb * (transmittance * opacity);
transmittance *= 1.0 - opacity;
//#section picture
//#part stop_picture
$PICTURE = vec4(colour, 1.0 - transmittance);
