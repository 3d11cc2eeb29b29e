//: Several channels in one picture, a sample of each in the middle of the segment: extinctions add, and each channel
//: gives light as its extinction does. Slots: channels adds each of them; voxel fetches all of them, where they share
//: texels.
vec3 at = start + stride * i;
//#part voxel
vec4 medium = vec4(0.0);
//#part channels
// Colour is light per extinction; where there is next to none of both there is nothing to see.
medium.rgb /= max(medium.a, 1e-9);
