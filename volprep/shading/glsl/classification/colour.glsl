//: In: a texel of the volume, rgb linear light times a, a share of the largest extinction.
// Light and extinction are in proportion to the texel, so that the texture filter mixes both.
const float LARGEST_PER_MM = $LARGEST_PER_MM;
vec4 classify(vec4 texel) {
  // Colour is light per extinction; where there is next to none of both there is nothing to see.
  return vec4(texel.rgb / max(texel.a, 1e-6), texel.a * LARGEST_PER_MM);
}
