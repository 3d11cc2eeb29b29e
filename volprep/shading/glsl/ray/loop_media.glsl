//: GLSL ES 3.00: a loop through media on several grids. Each medium jumps over its empty space, outside of its box
//: and by its own skip table. A run ends where another medium begins, and where the box of a medium does, so that
//: its samples are of the same media with the same weights. A run of one medium has a loop of its own: drivers
//: that run both sides of every branch save nothing by a condition in the loop. Word FIRST_SEEN: the least
//: seen$OF. Sections, of medium $OF: seen, with slot own_table; table, with BLOCK, the edge of its blocks in
//: voxels; start_of; look, for the next sample that shows it; ahead, before a run; alone, a run of this medium,
//: with OTHERS, the least seen of all others.
while (next < $LAST$GOING) {
  //#part media_look
  float run_start = $FIRST_SEEN;
  float run_end = min(run_start + $RUN, $LAST);
  //#part media_ahead
  next = run_end;
  bool several = true;
  //#part media_alone
  float end = several ? run_end : run_start;
  for (float i = run_start; i < end$GOING; i++) {
    //#part sample
  }
}
//#section seen
// The first sample from i on that may show the medium.
float seen_from$OF(float i) {
  if (i - 0.5 >= within$OF.y) {
    return 1e9;
  }
  float entered = floor(within$OF.x) + 0.5;
  if (i < entered) {
    return entered;
  }
  //#part own_table
  return i;
}
//#section table
vec3 blocks_from_texture = vec3(textureSize(u_volume$OF, 0)) / $BLOCK;
vec3 at = (start$OF + stride$OF * i) * blocks_from_texture - 0.5 / $BLOCK;
vec3 block_stride = stride$OF * blocks_from_texture;
vec3 block = floor(at);
float entry = skip_entry$OF(block);
if (entry > 0.0) {
  return i + empty_samples(at, block_stride, block, entry) + 1.0;
}
//#section start
// The first sample that is neither taken nor skipped.
float next = $FIRST;
//#section start_of
float seen$OF = next;
//#section look
seen$OF = max(seen$OF, next);
while (seen$OF < $LAST) {
  float later = seen_from$OF(seen$OF);
  if (later <= seen$OF) {
    break;
  }
  seen$OF = later;
}
//#section ahead
run_end = min(run_end, seen$OF > run_start ? seen$OF : end_of_run(run_start, within$OF));
weight$OF = u_opacity$OF * share(run_start, within$OF);
//#section alone
bool alone$OF = $OTHERS > run_start;
several = several && !alone$OF;
float end$OF = alone$OF ? run_end : run_start;
for (float i = run_start; i < end$OF$GOING; i++) {
  //#part sample
}
