//: Before samples from `next` on are taken: goes on behind what the table says is empty. Where it is not, the table is
//: read again after a run of samples, of the same length for all pixels: neighbours that run together stay together.
//: Samples that are skipped leave the others where they are.
vec3 at = block_start + block_stride * next;
vec3 block = floor(at);
float entry = skip_entry(block);
if (entry > 0.0) {
  next += empty_samples(at, block_stride, block, entry) + 1.0;
  continue;
}
