//: One fetch for all channels.
vec4 voxel = voxel_texel(at);
