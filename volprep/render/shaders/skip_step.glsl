//: At the head of the loop. A table is read once for each block that the ray meets, not for each sample. Samples that
//: are skipped leave the others where they are.
if (i > told) {
  vec3 at = block_start + block_stride * i;
  vec3 block = floor(at);
  float entry = skip_entry(block, block_stride);
  told = i + samples_told(at, block_stride, block, entry);
  if (entry > 0.0) {
    next = told + 1.0;
    continue;
  }
}
