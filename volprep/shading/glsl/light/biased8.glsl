//: In: RGB8 or RGBA8, LINEAR. Out: a vector about 1 long; the exact code 128 128 128 is 0.
// The vector of a code, about 1 long; 128 128 128 is 0.
vec3 decoded_normal(vec4 texel) {
  return (texel.rgb * 255.0 - 128.0) / 127.0;
}
