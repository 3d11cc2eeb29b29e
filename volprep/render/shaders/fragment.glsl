//: Fragment shader of all ray casters, both dialects, highp throughout.
//: In: v_near and v_far, homogeneous box millimetres; u_step_mm. Out: RGBA, premultiplied linear light, 0 to 1.
//: Slots: dialect; sampling gives position(millimetres) and stored_value(position); classification gives
//: classify(stored value) = (linear colour, extinction per millimetre); box gives clip_to_box; loop opens a block with
//: i = 0.5, 1.5, ... below count; termination may leave it.
//#part dialect
$VARYING_IN vec4 v_near;
$VARYING_IN vec4 v_far;
uniform float u_step_mm;

//#part sampling

//#part classification

//#part box

// The integral of colour * extinction * exp(-optical depth) along the pixel's ray, in equal segments of u_step_mm at
// most, with one sample in the middle of each. Gives premultiplied linear light; alpha is the opacity.
void main() {
  vec3 origin = v_near.xyz / v_near.w;
  vec3 ray = v_far.xyz / v_far.w - origin;
  vec2 inside = clip_to_box(origin, ray);
  float part = max(inside.y - inside.x, 0.0);
  float length_mm = part * length(ray);
  float count = ceil(length_mm / u_step_mm);
  float segment_mm = length_mm / max(count, 1.0);
  vec3 start = position(origin + ray * inside.x);
  vec3 stride = position(ray * (part / max(count, 1.0)));

  // Summing the depth and taking differences of exp(-depth) is front-to-back compositing with opacity
  // 1 - exp(-extinction * segment), without rounding each faint segment to float32's 1 - 6e-8.
  float depth = 0.0;
  float transmittance = 1.0;
  vec3 colour = vec3(0.0);
  //#part loop
    vec4 medium = classify(stored_value(start + stride * i));
    depth += medium.a * segment_mm;
    float remaining = exp(-depth);
    colour += medium.rgb * (transmittance - remaining);
    transmittance = remaining;
    //#part termination
  }
  $PICTURE = vec4(colour, 1.0 - transmittance);
}
