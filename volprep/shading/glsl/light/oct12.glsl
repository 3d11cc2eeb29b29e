//: In: RGB8 or RGBA8, NEAREST: codes beside the fold must not be mixed. Out: a unit vector; code 0 0 0 is 0.
//#part octahedron

// The unit vector of a code, two numbers of 12 bits; 0 where the code is 0, for no normal.
vec3 decoded_normal(vec4 texel) {
  vec3 bytes = floor(texel.rgb * 255.0 + 0.5);
  float high = floor(bytes.g / 16.0);
  vec2 numbers = vec2(bytes.r + (bytes.g - high * 16.0) * 256.0, high + bytes.b * 16.0);
  return numbers.x < 0.5 ? vec3(0.0) : folded((numbers - 2048.0) / 2047.0);
}
