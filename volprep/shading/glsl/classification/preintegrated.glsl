//: In: u_preintegrated, RGBA8, N x 4, NEAREST: in column j the sums of the transfer function up to its stored value, of
//: red, green and blue times extinction and of extinction, each in the four bytes of a texel, the lowest first. Section
//: start: before the loop.
// The transfer function, averaged over all normalised stored values between the two ends of a segment: rgb linear
// colour, weighted by extinction; a extinction per millimetre. The back becomes the front of the next segment.
uniform highp sampler2D u_preintegrated;
// Extinction per millimetre where a sum grows by its highest byte from one entry to the next.
const float EXTINCTION_PER_MM = $EXTINCTION_PER_MM;
const vec4 BYTES = vec4(5.9604645e-8, 1.5258789e-5, 0.00390625, 1.0);
// One end of a segment: the sums at the entry before its value, in bytes; by how much each grows up to the next entry;
// that entry, and how far from it to the next one the value is; beyond the table less than 0, or more than 1.
struct End {
  vec4 red;
  vec4 green;
  vec4 blue;
  vec4 depth;
  vec4 growth;
  float entry;
  float share;
};
// Bytes of a sum. They are whole numbers, so that their differences are exact.
vec4 sum_at(float entry, float row) {
  return floor($TEXTURE_2D(u_preintegrated, vec2((entry + 0.5) * $PER_ENTRY, row)) * 255.0 + 0.5);
}
End end_at(vec3 position) {
  float place = (stored_value(position) - $FIRST_VALUE) * $ENTRIES_PER_VALUE;
  float entry = clamp(floor(place), 0.0, $LAST_SEGMENT);
  vec4 red = sum_at(entry, 0.125);
  vec4 green = sum_at(entry, 0.375);
  vec4 blue = sum_at(entry, 0.625);
  vec4 depth = sum_at(entry, 0.875);
  float next = entry + 1.0;
  vec4 growth = vec4(
    dot(sum_at(next, 0.125) - red, BYTES),
    dot(sum_at(next, 0.375) - green, BYTES),
    dot(sum_at(next, 0.625) - blue, BYTES),
    dot(sum_at(next, 0.875) - depth, BYTES)
  );
  return End(red, green, blue, depth, growth, entry, place - entry);
}
vec4 classify(inout End front, End back) {
  vec4 between = vec4(
    dot(back.red - front.red, BYTES),
    dot(back.green - front.green, BYTES),
    dot(back.blue - front.blue, BYTES),
    dot(back.depth - front.depth, BYTES)
  );
  between += back.growth * back.share - front.growth * front.share;
  float entries = back.entry - front.entry + (back.share - front.share);
  // Where both ends are nearly one value, or between the same two entries, the quotient would lose digits.
  bool is_point = abs(entries) < $LEAST_ENTRIES || back.entry == front.entry;
  vec4 mean = is_point ? 0.5 * (front.growth + back.growth) : between / entries;
  front = back;
  return vec4(mean.rgb / max(mean.a, 1e-12), max(mean.a, 0.0) * EXTINCTION_PER_MM);
}
//#section start
// The front of the first segment.
End front = end_at($FIRST_FRONT);
