//: A slab of the samples of each ray. Sections: uniform; last. Word of last: END, the last sample of the ray.
//#section uniform
uniform float u_step_mm;
// Samples of the ray in front of this slab.
uniform float u_first_sample;
//#section last
float last = min($END, u_first_sample + $SLAB);
