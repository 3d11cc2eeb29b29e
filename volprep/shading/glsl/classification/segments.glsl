//: A scan with its segments, both dialects. In: u_labels, one or two bytes for each voxel, NEAREST: its label, low byte
//: first; the highest bit says that the cell which begins at the voxel has several labels. u_segments, RGBA8, NEAREST,
//: a texel for each label: rgb the square root of the tint, linear, a the opacity factor, 0 if hidden. Slots: channels
//: gives classify_0, classify_1, ..., one for each style; texels declares u_labels; styles, no_sums, own_sums and added
//: have the sections of these names, without the plural, for each style; one_label is the section of its name; borders
//: is section mixed or crisp; labels and around are the sections of these names, which segments_values.glsl uses too;
//: corner_labels is section each_corner, or corners_in_turn for sub-volumes; in_turns is section single, or nothing
//: where slot of_group of the loop is section group; where it is section lit_group, lit_samples has a section
//: lit_sample for each sample of it, K.
//: Where it is lit, border_slope gives the normal of borders, and border_row is section each_of_row, or row_in_turn for
//: sub-volumes; VOXEL and POSITION_PER_MM come from the sampling.
//: Words: CODE, the texel at `at` as a number; FLAG; PLACE, the position `at` in voxels; OF_VOXELS, how `at` is made
//: from a position in voxels; ENTRY, the place of a label in u_segments.
//#part channels

//#part texels
//#part labels

//#part lit_segments
// What the labels around a place do to each style: the sums of tint times opacity, and of opacity.
//#part styles
// Looks at the labels around a place of the volume.
void look_around(vec3 at) {
  //#part no_border
  vec3 place = $PLACE - 0.5;
  vec3 voxel = floor(place);
  vec3 low = (voxel + 0.5)$OF_VOXELS;
  float label = label_code(low);
  if (label < FLAG - 0.5) {
    //#part one_label
    return;
  }
  //#part around
  //#part border
  //#part borders
}
// Colour and extinction there, from the media of each style.
vec4 seen($MEDIA) {
  vec4 medium = vec4(0.0);
  //#part added
  return vec4(medium.rgb / max(medium.a, 1e-9), medium.a);
}
//#part in_turns

//#part border_slope
//#section texture3d
// The labels as a 3D texture.
uniform highp sampler3D u_labels;
//#section labels
// Labels of voxels. From FLAG on the cell, up to the next voxel along each axis, has several labels.
const float FLAG = $FLAG;
float label_code(vec3 at) {
  return $CODE;
}
float label_of(vec3 at) {
  float code = label_code(at);
  return code > FLAG - 0.5 ? code - FLAG : code;
}

// Current look of each label, as square roots: rgb its tint, a its opacity factor, 0 if it is hidden.
uniform highp sampler2D u_segments;
vec4 look_of(float label) {
  vec4 look = $TEXTURE_2D(u_segments, $ENTRY);
  return look * look;
}
//#section around
// Labels of the eight voxels around it, and their trilinear weights.
//#part corner_labels
vec3 share = place - voxel;
vec2 along_x = vec2(1.0 - share.x, share.x);
vec2 along_y = vec2(1.0 - share.y, share.y);
vec4 across = along_x.xyxy * along_y.xxyy;
vec4 weights_near = across * (1.0 - share.z);
vec4 weights_far = across * share.z;
//#section each_corner
vec3 high = (voxel + 1.5)$OF_VOXELS;
vec4 labels_near = vec4(
  label_of(low), label_of(vec3(high.x, low.yz)), label_of(vec3(low.x, high.y, low.z)), label_of(vec3(high.xy, low.z))
);
vec4 labels_far = vec4(
  label_of(vec3(low.xy, high.z)), label_of(vec3(high.x, low.y, high.z)), label_of(vec3(low.x, high.yz)), label_of(high)
);
//#section corners_in_turn
// In a loop, since each call chooses among eight pieces: drivers that write it out for all corners need minutes.
vec4 labels_near = vec4(0.0);
vec4 labels_far = vec4(0.0);
for (int corner = 0; corner < 4; corner++) {
  vec2 beside = vec2(mod(float(corner), 2.0), floor(0.5 * float(corner))) + 0.5;
  labels_near[corner] = label_of(voxel + vec3(beside, 0.5));
  labels_far[corner] = label_of(voxel + vec3(beside, 1.5));
}
//#section media
vec4 medium$OF = classify$OF(stored);
//#section shown
float shown = $SHOWN;
//#section chosen
medium = label < $FIRST ? medium : medium$OF;
//#section style
vec4 sum$OF = vec4(0.0);
//#section one_label
vec4 own = look_of(label);
own.rgb *= own.a;
//#part own_sums
//#section own_sum
sum$OF = own$SHARE;
//#section mixed
//#part no_sums
for (int corner = 0; corner < 4; corner++) {
  //#part corners
}
//#section lit_segments
// Of the place that was looked at last: where labels of different extinctions meet 9, the number of rows of voxels that
// border_slope reads, else 0; the place in voxels; the extinctions of all styles there.
float border_rows;
vec3 border_place;
float $KEPT;
// The visible extinction of a label, at the value of that place.
float seen_extinction(float label) {
  float extinction = kept_0;
  //#part seen_chosen
  return extinction * look_of(label).a;
}

//#section no_border
border_rows = 0.0;
//#section border
border_place = place;
float lowest = 1e30;
float highest = 0.0;
for (int corner = 0; corner < 4; corner++) {
  float seen_near = seen_extinction(labels_near[corner]);
  float seen_far = seen_extinction(labels_far[corner]);
  lowest = min(lowest, min(seen_near, seen_far));
  highest = max(highest, max(seen_near, seen_far));
}
border_rows = highest > lowest ? 9.0 : 0.0;
//#section slope
// Where labels meet, the slope per millimetre of the logarithm of the visible extinction, with the value held. The
// voxels around have the weights of quadratic B-splines, so that borders of voxels look smooth. A separate function:
// drivers that take both branches then leave out the loop where no ray needs it. A turn takes the three voxels along x,
// whose weights it shares with the others: 27 turns took up to 1.18 times the time of a picture on Mesa's software
// driver.
vec3 border_slope() {
  vec3 middle = floor(border_place + 0.5);
  vec3 share = border_place - middle;
  vec2 reach_x = 0.5 + vec2(-share.x, share.x);
  vec3 weight_x = vec3(0.5 * reach_x.x * reach_x.x, 0.75 - share.x * share.x, 0.5 * reach_x.y * reach_x.y);
  vec3 slope_x = vec3(-reach_x.x, -2.0 * share.x, reach_x.y);
  vec4 seen = vec4(0.0);
  for (float k = 0.0; k < 9.0; k++) {
    if (k >= border_rows) {
      break;
    }
    vec2 offset = vec2(mod(k, 3.0), floor(k / 3.0)) - 1.0;
    vec3 voxel = middle + vec3(0.0, offset) + 0.5;
    //#part border_row
    vec2 reach = 0.5 + offset * share.yz;
    vec2 is_middle = 1.0 - abs(offset);
    vec2 weight = mix(0.5 * reach * reach, 0.75 - share.yz * share.yz, is_middle);
    vec2 slope = mix(offset * reach, -2.0 * share.yz, is_middle);
    vec4 along_x = vec4(dot(row, slope_x), vec3(dot(row, weight_x)));
    seen += along_x * vec4(weight.x, slope.x, weight.xx) * vec4(weight.yy, slope.y, weight.y);
  }
  return seen.xyz * $POSITION_PER_MM / ($VOXEL * max(seen.w, 1e-9));
}

//#section each_of_row
vec3 beside = vec3(1.0, 0.0, 0.0);
vec3 row = vec3(
  seen_extinction(label_of((voxel - beside)$OF_VOXELS)), seen_extinction(label_of(voxel$OF_VOXELS)),
  seen_extinction(label_of((voxel + beside)$OF_VOXELS))
);
//#section row_in_turn
// In a loop, as the corners of a cell.
vec3 row = vec3(0.0);
for (int x = 0; x < 3; x++) {
  row[x] = seen_extinction(label_of(voxel + vec3(float(x) - 1.0, 0.0, 0.0)));
}
//#section seen_chosen
extinction = label < $FIRST ? extinction : kept$OF;
//#section no_sum
sum$OF = vec4(0.0);
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
//#part one_label
//#section single
// Colour and extinction at a place of the volume.
vec4 classify_segments(vec3 at) {
  float stored = stored_value(at);
  //#part media
  //#part shown
  if (shown == 0.0) {
    return vec4(0.0);
  }
  //#part kept
  look_around(at);
  return seen($ARGUMENTS);
}
//#section kept
kept$OF = medium$OF.a;
//#section group
// What each style is at the samples, and the labels in the middle of them.
//#part declared
float shown = 0.0;
for (int k = 0; k < $GROUP; k++) {
  float stored = stored_value(start + stride * (first + float(k)));
  //#part media
}
if (shown > 0.0) {
  look_around(start + stride * (first + $HALF_GROUP));
}
//#section lit_group
// Media of the samples, which share the gradient, and the slope of borders, halfway between them.
vec4 media[$GROUP];
float bordered[$GROUP];
float visible = 0.0;
float rows = 0.0;
//#part shared
//#part lit_samples
vec3 at = start + stride * (first + $HALF_GROUP);
border_place = $PLACE - 0.5;
border_rows = rows;
//#part keep_shared
vec3 slope = border_slope();
vec3 gradient = vec3(0.0);
if (visible > 0.0) {
  gradient = normal_at(at);
}
//#section lit_sample
media[$K] = classify_segments(start + stride * (first + $K.0));
visible = max(visible, media[$K].a);
bordered[$K] = media[$K].a > 0.0 && border_rows > 0.0 ? 1.0 : 0.0;
rows = max(rows, bordered[$K] * border_rows);
//#part add_kept
//#section shared
float shared$OF = 0.0;
//#section add_kept
shared$OF += bordered[$K] * kept$OF;
//#section keep_shared
kept$OF = shared$OF;
//#section declared
vec4 media$OF[$GROUP];
//#section media_of_group
media$OF[k] = classify$OF(stored);
shown = max(shown, media$OF[k].a);
