//: In: RG8, LUMINANCE_ALPHA or RGB8, NEAREST: codes beside the fold must not be mixed.
//: Out: a unit vector; code 0 0 is 0.
//#part octahedron

// The unit vector of a code; 0 where the code is 0 0, for no normal.
vec3 decoded_normal(vec4 texel) {
  vec2 bytes = texel.$NUMBERS * 255.0;
  return bytes.x < 0.5 ? vec3(0.0) : folded((bytes - 128.0) / 127.0);
}
