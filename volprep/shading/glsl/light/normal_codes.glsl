//: Normals from texels, a section for each code; all give decoded_normal. biased8: RGB8 or RGBA8, LINEAR, and
//: snorm8: RGB8_SNORM or RGBA8_SNORM, LINEAR: about 1 long, 0 for the exact code of no normal. oct8: RG8,
//: LUMINANCE_ALPHA or RGB8, in which $NUMBERS are the code, and oct12: RGB8 or RGBA8: unit vectors, NEAREST, as
//: codes beside the fold must not be mixed.
//#section biased8
// The vector of a code, about 1 long; 128 128 128 is 0.
vec3 decoded_normal(vec4 texel) {
  return (texel.rgb * 255.0 - 128.0) / 127.0;
}
//#section snorm8
// The vector of a code, about 1 long.
vec3 decoded_normal(vec4 texel) {
  return texel.rgb;
}
//#section oct8
//#part octahedron

// The unit vector of a code; 0 where the code is 0 0, for no normal.
vec3 decoded_normal(vec4 texel) {
  vec2 bytes = texel.$NUMBERS * 255.0;
  return bytes.x < 0.5 ? vec3(0.0) : folded((bytes - 128.0) / 127.0);
}
//#section oct12
//#part octahedron

// The unit vector of a code, two numbers of 12 bits; 0 where the code is 0, for no normal.
vec3 decoded_normal(vec4 texel) {
  vec3 bytes = floor(texel.rgb * 255.0 + 0.5);
  float high = floor(bytes.g / 16.0);
  vec2 numbers = vec2(bytes.r + (bytes.g - high * 16.0) * 256.0, high + bytes.b * 16.0);
  return numbers.x < 0.5 ? vec3(0.0) : folded((numbers - 2048.0) / 2047.0);
}
