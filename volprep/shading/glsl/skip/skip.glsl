//: Empty-space skipping. Slots: skip_table gives block_position and block_offset, from box millimetres to blocks, and
//: skip_entry(block), the entry of a block, 0 where it is not empty. Section start: before the loop; FIRST is the first
//: sample.
//#part skip_table

// Steps until the ray leaves the blocks that are nearer than the entry, which is not 0: all of them are empty.
float steps_to_leave(vec3 at, vec3 slope, vec3 block, float entry) {
  vec3 end = block + mix(vec3(1.0 - entry), vec3(entry), vec3(greaterThan(slope, vec3(0.0))));
  vec3 steps = (end - at) / slope;
  return min(steps.x, min(steps.y, steps.z));
}

// Samples that are taken before the table is read again.
const float RUN = $RUN;
// A sample this near to the end of an empty region, in steps, is looked at after all: what float32 rounds away is less.
const float SKIP_MARGIN = 0.015625;
// Number of samples after the one at `at`, every `stride` further, that its block's entry says are empty; in blocks.
float empty_samples(vec3 at, vec3 stride, vec3 block, float entry) {
  // As where the ray meets the box: a slope of 1e-7 instead of none.
  vec3 least = vec3(1e-7 * length(stride));
  vec3 slope = mix(stride, least, vec3(lessThan(abs(stride), least)));
  return floor(max(steps_to_leave(at, slope, block, entry) - SKIP_MARGIN, 0.0));
}
//#section start
vec3 block_start = block_position(origin + ray * inside.x);
vec3 block_stride = block_offset(ray * (part / max(count, 1.0)));
// The first sample that is neither taken nor skipped.
float next = $FIRST;
