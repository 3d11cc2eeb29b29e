//: Maximum intensity difference accumulation (Bruckner and Groeller 2009). Sections: about; start, before the loop;
//: sample, in it, the segment whose middle is i; picture. The sampling gives stored_value, the classification classify.
//#section about
// Light of equal segments of u_step_mm at most, front to back. A segment whose intensity exceeds the greatest one so
// far hides the same share of the light in front of it. Gives premultiplied linear light; alpha is the opacity.
// Intensity, 0 to 1, of a normalised stored value.
const float INTENSITY_SCALE = $INTENSITY_SCALE;
const float INTENSITY_OFFSET = $INTENSITY_OFFSET;
//#section start
float segment_mm = length_mm / max(count, 1.0);
float greatest = 0.0;
float opacity = 0.0;
vec3 colour = vec3(0.0);
//#section sample
float stored = stored_value(start + stride * i);
vec4 medium = classify(stored);
float intensity = clamp(stored * INTENSITY_SCALE + INTENSITY_OFFSET, 0.0, 1.0);
float kept = 1.0 - max(intensity - greatest, 0.0);
greatest = max(greatest, intensity);
float gain = (1.0 - kept * opacity) * (1.0 - exp(-medium.a * segment_mm));
colour = kept * colour + gain * medium.rgb;
opacity = kept * opacity + gain;
//#section picture
$PICTURE = vec4(colour, opacity);
