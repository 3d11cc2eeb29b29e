//: In: RGB8_SNORM or RGBA8_SNORM, LINEAR. Out: a vector about 1 long; the exact code 0 0 0 is 0.
// The vector of a code, about 1 long.
vec3 decoded_normal(vec4 texel) {
  return texel.rgb;
}
