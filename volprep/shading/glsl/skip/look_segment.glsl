//: As look.glsl, for pre-integration, surfaces and rays that go from cell to cell: a segment is empty where both its
//: ends lie in what an entry tells of. The one across its end is drawn. Section front, in slot jumped, is for segments
//: whose ends are sampled: the front of the next one is read again, and in slot restart its other properties.
vec3 at = block_start + block_stride * (next - 0.5);
vec3 block = floor(at);
float entry = skip_entry(block);
float segments = entry > 0.0 ? empty_samples(at, block_stride, block, entry) : 0.0;
if (segments > 0.0) {
  next += segments;
  //#part jumped
  continue;
}
//#section front
front = $FRONT_AT(start + stride * (next - 0.5));
//#part restart
