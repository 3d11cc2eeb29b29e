//: A slab of the samples of each ray. Sections: uniform; last.
//#section uniform
uniform float u_step_mm;
// Samples of the ray in front of this slab.
uniform float u_first_sample;
//#section last
float last = min(count, u_first_sample + $SLAB);
