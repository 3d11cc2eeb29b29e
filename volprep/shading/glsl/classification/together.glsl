//: Several channels in one picture. Slots: channels gives classify_0, classify_1, ...; voxel fetches all channels at
//: once, where they share texels; sum adds each of them: section channel, of the channel $OF, which
//: CLASSIFY classifies; section alone, of a channel on a grid of its own. Slot light_of_medium: in a picture that is
//: lit, section lit, or section alone.
//#part channels

// Colour and extinction of all channels: extinctions add, and each channel gives light as its extinction does.
vec4 classify_together($AT) {
  //#part voxel
  vec4 medium = vec4(0.0);
  //#part sum
  // Colour is light per extinction; where there is next to none of both there is nothing to see.
  medium.rgb /= max(medium.a, 1e-9);
  return medium;
}
//#section voxel
vec4 voxel = voxel_texel(at);
//#section channel
vec4 part$OF = $CLASSIFY;
medium += vec4(part$OF.rgb * part$OF.a, part$OF.a);
//#section lit
// Colour and extinction of one channel at a place, lit.
vec4 classify_lit$OF(vec3 at, float value) {
  vec4 medium = classify$OF(value);
  //#part light_of_medium
  return medium;
}
//#section alone
// Colour and extinction of one channel in the segment whose middle is i.
vec4 classify_alone$OF(float i) {
  vec4 medium = classify$OF(stored_value$OF(start$OF + stride$OF * i));
  //#part light_of_medium
  medium.a *= weight$OF;
  return medium;
}
//#section colour
// Light and extinction are in proportion to the texel, so that the texture filter mixes both.
const float LARGEST_PER_MM = $LARGEST_PER_MM;
vec4 classify(vec4 texel) {
  // Colour is light per extinction; where there is next to none of both there is nothing to see.
  return vec4(texel.rgb / max(texel.a, 1e-6), texel.a * LARGEST_PER_MM);
}
