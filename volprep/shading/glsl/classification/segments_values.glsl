//: A scan with its segments where a ray shows one value, at one place; both dialects. Inputs, words and slots as in
//: segments.glsl. The sampling gives scan_value. Slot valued is section value, which a shadow map has alone; slot shown
//: is section mixed or crisp. Words: HIDDEN, less than any value; OF_POSITION, how a position of the sampling is made
//: from one in voxels.
//#part channels

//#part valued

//#part weight
// Colour and extinction of a value at a place, from the shown labels of the voxels around it.
vec4 classify_at(vec3 at, float stored) {
  //#part media
  vec3 place = $PLACE - 0.5;
  vec3 voxel = floor(place);
  vec3 low = (voxel + 0.5)$OF_VOXELS;
  //#part around
  //#part shown
}
//#section value
//#part texels
//#part labels

// The value at a place. Voxels of hidden labels count as less than any value.
const float HIDDEN = $HIDDEN;
float stored_value(vec3 at) {
  vec3 place = $PLACE - 0.5;
  vec3 voxel = floor(place);
  vec3 low = (voxel + 0.5)$OF_VOXELS;
  float label = label_code(low);
  if (label < FLAG - 0.5) {
    return look_of(label).a > 0.0 ? scan_value(at) : HIDDEN;
  }
  //#part around
  float value = 0.0;
  float hidden = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    vec2 beside = vec2(mod(float(corner), 2.0), floor(0.5 * float(corner))) + 0.5;
    float seen_near = look_of(labels_near[corner]).a > 0.0 ? weights_near[corner] : 0.0;
    float seen_far = look_of(labels_far[corner]).a > 0.0 ? weights_far[corner] : 0.0;
    value += seen_near * scan_value((voxel + vec3(beside, 0.5))$OF_POSITION);
    value += seen_far * scan_value((voxel + vec3(beside, 1.5))$OF_POSITION);
    hidden += weights_near[corner] - seen_near + weights_far[corner] - seen_far;
  }
  return hidden > 0.0 ? value + hidden * HIDDEN : scan_value(at);
}
//#section mixed
vec4 sum = vec4(0.0);
float shown = 0.0;
for (int corner = 0; corner < 8; corner++) {
  float label = corner < 4 ? labels_near[corner] : labels_far[corner - 4];
  float weight = corner < 4 ? weights_near[corner] : weights_far[corner - 4];
  vec4 look = look_of(label);
  vec4 medium = medium_0;
  //#part chosen
  medium *= look;
  weight = look.a > 0.0 ? weight : 0.0;
  sum += weight * vec4(medium.rgb * medium.a, medium.a);
  shown += weight;
}
return vec4(sum.rgb / max(sum.a, 1e-9), sum.a / max(shown, 1e-9));
//#section crisp
// The shown label whose voxels weigh most; of those that hardly differ the smallest, whatever rounding does.
float most = 0.0;
for (int corner = 0; corner < 8; corner++) {
  float own = corner < 4 ? labels_near[corner] : labels_far[corner - 4];
  most = max(most, look_of(own).a > 0.0 ? weight_of(own, labels_near, labels_far, weights_near, weights_far) : 0.0);
}
float label = FLAG;
for (int corner = 0; corner < 8; corner++) {
  float own = corner < 4 ? labels_near[corner] : labels_far[corner - 4];
  float weight = weight_of(own, labels_near, labels_far, weights_near, weights_far);
  label = look_of(own).a > 0.0 && weight > most - $SAME ? min(label, own) : label;
}
vec4 medium = medium_0;
//#part chosen
return most > 0.0 ? medium * look_of(label) : vec4(0.0);
//#section weight
// The share of a label among eight voxels.
float weight_of(float label, vec4 labels_near, vec4 labels_far, vec4 weights_near, vec4 weights_far) {
  return dot(weights_near, vec4(equal(labels_near, vec4(label)))) +
         dot(weights_far, vec4(equal(labels_far, vec4(label))));
}
