//: A scan with its segments, both dialects. In: u_labels, one or two bytes for each voxel, NEAREST: its label, low byte
//: first; the highest bit says that the cell which begins at the voxel has several labels. u_segments, RGBA8, NEAREST,
//: a texel for each label: rgb the square root of the tint, linear, a the opacity factor, 0 if hidden. Slots: channels
//: gives classify_0, classify_1, ..., one for each style; texels declares u_labels; media classifies a value in every
//: style, shown is the largest extinction of them; chosen is the style of a label; borders is section mixed or crisp.
//: Where it is lit: lit declares border_slope, unlit sets it to 0, seen and slope find it; VOXEL and POSITION_PER_MM are
//: those of the sampling.
//: Words: CODE, the texel at `at` as a number; FLAG; PLACE, the position `at` in voxels; OF_VOXELS, how `at` is made
//: from a position in voxels; ENTRY, the place of a label in u_segments.
//#part channels

//#part texels
// Labels of voxels. From FLAG on the cell, up to the next voxel along each axis, has several labels.
const float FLAG = $FLAG;
float label_code(vec3 at) {
  return $CODE;
}
float label_of(vec3 at) {
  float code = label_code(at);
  return code > FLAG - 0.5 ? code - FLAG : code;
}

// What each label looks like now: rgb its tint, a its opacity factor, 0 if it is hidden.
uniform highp sampler2D u_segments;
vec4 look_of(float label) {
  vec4 look = $TEXTURE_2D(u_segments, $ENTRY);
  return vec4(look.rgb * look.rgb, look.a);
}

//#part lit_segments
// Colour and extinction at a place of the volume.
vec4 classify_segments(vec3 at) {
  //#part no_border
  float stored = stored_value(at);
  //#part media
  if (shown == 0.0) {
    return vec4(0.0);
  }
  vec3 place = $PLACE - 0.5;
  vec3 voxel = floor(place);
  vec3 low = (voxel + 0.5)$OF_VOXELS;
  float label = label_code(low);
  if (label < FLAG - 0.5) {
    vec4 medium = medium_0;
    //#part chosen
    return medium * look_of(label);
  }
  // Labels of the eight voxels around it, and their trilinear weights.
  vec3 high = (voxel + 1.5)$OF_VOXELS;
  vec4 labels_near = vec4(
    label_of(low), label_of(vec3(high.x, low.yz)), label_of(vec3(low.x, high.y, low.z)),
    label_of(vec3(high.xy, low.z)));
  vec4 labels_far = vec4(
    label_of(vec3(low.xy, high.z)), label_of(vec3(high.x, low.y, high.z)), label_of(vec3(low.x, high.yz)),
    label_of(high));
  vec3 share = place - voxel;
  vec2 along_x = vec2(1.0 - share.x, share.x);
  vec4 across = vec4(along_x * (1.0 - share.y), along_x * share.y);
  vec4 weights_near = across * (1.0 - share.z);
  vec4 weights_far = across * share.z;
  //#part border_slope
  //#part borders
}
//#section texture3d
// The labels as a 3D texture.
uniform highp sampler3D u_labels;
//#section media
vec4 medium$OF = classify$OF(stored);
//#section shown
float shown = $SHOWN;
//#section chosen
medium = label < $FIRST ? medium : medium$OF;
//#section mixed
// What all labels of one style do to it: the sums of opacity, and of tint times opacity.
//#part sums
for (int corner = 0; corner < 4; corner++) {
  //#part corners
}
vec4 medium = vec4(0.0);
//#part added
return vec4(medium.rgb / max(medium.a, 1e-9), medium.a);
//#section lit_segments
// Where labels meet, the slope of the logarithm of the visible extinction per millimetre, with the value held: of the
// place that was classified last.
vec3 border_slope;

//#section no_border
border_slope = vec3(0.0);
//#section seen
// Visible extinction of the eight voxels, each at the value of this place.
vec4 seen_near;
vec4 seen_far;
for (int corner = 0; corner < 4; corner++) {
  //#part seen_corners
}
vec4 seen = mix(seen_near, seen_far, share.z);
vec2 seen_x = mix(seen.xy, seen.zw, share.y);
vec2 rise_y = seen.zw - seen.xy;
vec4 rise = seen_far - seen_near;
vec2 rise_z = mix(rise.xy, rise.zw, share.y);
border_slope = vec3(seen_x.y - seen_x.x, mix(rise_y.x, rise_y.y, share.x), mix(rise_z.x, rise_z.y, share.x));
border_slope *= $POSITION_PER_MM / ($VOXEL * max(mix(seen_x.x, seen_x.y, share.x), 1e-9));
//#section seen_corner
float seen_of_$SIDE = medium_0.a;
//#part chosen
seen_$SIDE[corner] = seen_of_$SIDE * look_of(labels_$SIDE[corner]).a;
//#section seen_chosen
seen_of_$SIDE = labels_$SIDE[corner] < $FIRST ? seen_of_$SIDE : medium$OF.a;
//#section sum
vec4 sum$OF = vec4(0.0);
//#section corner
vec4 look_$SIDE = look_of(labels_$SIDE[corner]);
look_$SIDE = weights_$SIDE[corner] * vec4(look_$SIDE.rgb * look_$SIDE.a, look_$SIDE.a);
//#section corner_sum
sum$OF += look_$SIDE$SHARE;
//#section added
medium += vec4(medium$OF.rgb * sum$OF.rgb, sum$OF.a) * medium$OF.a;
//#section crisp
// The label whose voxels weigh most, of equals the smallest.
float most = -1.0;
for (int corner = 0; corner < 8; corner++) {
  float own = corner < 4 ? labels_near[corner] : labels_far[corner - 4];
  float weight = dot(weights_near, vec4(equal(labels_near, vec4(own))));
  weight += dot(weights_far, vec4(equal(labels_far, vec4(own))));
  bool better = weight > most || (weight == most && own < label);
  label = better ? own : label;
  most = better ? weight : most;
}
vec4 medium = medium_0;
//#part chosen
return medium * look_of(label);
