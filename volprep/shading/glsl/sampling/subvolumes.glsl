//: GLSL ES 3.00. In: u_subvolume_0 to _7, the pieces around a point of the grid, R8, R16 or R16F, 3D, LINEAR,
//: CLAMP_TO_EDGE. A piece that does not exist is never reached: u_split lies outside the volume there. Where voxels
//: have labels, in the components after the value: section labels. Word: STORED, the function.
// Level 0 as up to eight pieces that share a layer of voxels with their neighbours. They fill the box from u_box_low_mm
// to u_box_high_mm.
uniform highp sampler3D u_subvolume_0;
uniform highp sampler3D u_subvolume_1;
uniform highp sampler3D u_subvolume_2;
uniform highp sampler3D u_subvolume_3;
uniform highp sampler3D u_subvolume_4;
uniform highp sampler3D u_subvolume_5;
uniform highp sampler3D u_subvolume_6;
uniform highp sampler3D u_subvolume_7;
uniform vec3 u_split;
uniform vec3 u_low_start;
uniform vec3 u_low_size;
uniform vec3 u_high_start;
uniform vec3 u_high_size;
uniform vec3 u_box_low_mm;
uniform vec3 u_box_high_mm;
vec4 piece_texel(vec3 at) {
  vec3 upper = step(u_split, at);
  vec3 inside = (at - mix(u_low_start, u_high_start, upper)) / mix(u_low_size, u_high_size, upper);
  if (upper.z < 0.5) {
    if (upper.y < 0.5) {
      return upper.x < 0.5 ? textureLod(u_subvolume_0, inside, 0.0) : textureLod(u_subvolume_1, inside, 0.0);
    }
    return upper.x < 0.5 ? textureLod(u_subvolume_2, inside, 0.0) : textureLod(u_subvolume_3, inside, 0.0);
  }
  if (upper.y < 0.5) {
    return upper.x < 0.5 ? textureLod(u_subvolume_4, inside, 0.0) : textureLod(u_subvolume_5, inside, 0.0);
  }
  return upper.x < 0.5 ? textureLod(u_subvolume_6, inside, 0.0) : textureLod(u_subvolume_7, inside, 0.0);
}
float $STORED(vec3 at) {
  return piece_texel(at).r;
}
//#section labels
// Value and label of a voxel, bytes, through a linear filter. A little behind the centre of a texel it gives the texel,
// whether a driver rounds positions or cuts them: three times 1/4096 of 255 is less than half a byte.
vec4 label_texel(vec3 at) {
  return floor(piece_texel(at + 1.0 / 4096.0) * 255.0 + 0.5);
}
