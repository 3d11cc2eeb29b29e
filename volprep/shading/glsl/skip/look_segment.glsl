//: As look.glsl, for pre-integration and surfaces: a segment is empty where both its ends lie in what an entry tells
//: of. The one across its end is drawn; its front is read anew, and in slot restart what else is known of it.
vec3 at = block_start + block_stride * (next - 0.5);
vec3 block = floor(at);
float entry = skip_entry(block, block_stride);
float segments = entry > 0.0 ? empty_samples(at, block_stride, block, entry) : 0.0;
if (segments > 0.0) {
  next += segments;
  front = stored_value(start + stride * (next - 0.5));
  //#part restart
  continue;
}
