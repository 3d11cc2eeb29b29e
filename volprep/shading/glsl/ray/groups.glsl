//: Several samples in each turn of a loop, for what changes slowly and takes long to read. Slot of_group reads it, slot
//: sample is as in loops of single samples. In: first, the first sample of the group. Words: LAST, behind the samples;
//: GROUP, the samples of a group, and IN_GROUP, the same as a float. Groups begin at the first sample of a whole ray or
//: at every GROUPth one after it, wherever a loop begins, so that rays that skip draw the same picture. Sections:
//: within, in slot within, behind `medium`; run, before a run of samples; one and run_of_one, for single samples.
//#part of_group
for (int k = 0; k < $GROUP; k++) {
  float i = first + float(k);
  //#part sample
}
//#section within
// No samples lie behind the last one.
medium.a = i < $LAST ? medium.a : 0.0;
//#section run
float run_start = next - mod(next - 0.5, $IN_GROUP);
next = run_start + RUN;
//#section one
//#part sample
//#section run_of_one
float run_start = next;
next += RUN;
