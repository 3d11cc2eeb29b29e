//: At the head of the loop, for pre-integration: a segment is empty where both its ends lie in what an entry tells of.
//: The one across its end is drawn; its front is read anew.
if (i > told) {
  vec3 at = block_start + block_stride * (i - 0.5);
  vec3 block = floor(at);
  float entry = skip_entry(block, block_stride);
  float segments = samples_told(at, block_stride, block, entry);
  if (entry == 0.0) {
    told = i + segments;
  } else if (segments > 0.0) {
    next = i + segments;
    if (next < count) {
      front = stored_value(start + stride * (next - 0.5));
    }
    continue;
  }
}
