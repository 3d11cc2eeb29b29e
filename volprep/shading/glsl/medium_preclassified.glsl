//: Pre-classified voxels: one sample in the middle of the segment.
vec4 medium = classify(voxel_texel(start + stride * i));
