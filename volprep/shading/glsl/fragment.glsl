//: Fragment shader of all ray casters, both dialects, highp throughout.
//: In: ray_ends gives v_near and v_far, homogeneous box millimetres; u_step_mm. Out: RGBA, premultiplied linear light,
//: 0 to 1.
//: Slots: dialect; sampling gives position(millimetres) and stored_value(position); classification gives
//: classify(stored value) = (linear colour, extinction per millimetre), or the same for the two ends of a segment; box
//: gives clip_to_box; first stands before the loop; loop opens a block with i = 0.5, 1.5, ... below count; medium gives
//: `medium`, colour and extinction of the segment whose middle is i; termination may leave the block. Where empty
//: space is skipped: skipping gives the table, skip_start begins, loop opens two blocks, loop_end closes the outer one.
//: At proxy geometry: ray_ends also gives where the ray meets it, ray_of_pixel makes v_near and v_far, entry_start
//: finds the first sample.
//: Where there is light: lighting gives the normals, light_start begins, light changes the colour of `medium`.
//#part dialect
//#part ray_ends
uniform float u_step_mm;

//#part sampling

//#part classification

//#part box

//#part skipping

//#part lighting

// The integral of colour * extinction * exp(-optical depth) along the pixel's ray, in equal segments of u_step_mm at
// most. Gives premultiplied linear light; alpha is the opacity.
void main() {
  //#part ray_of_pixel
  vec3 origin = v_near.xyz / v_near.w;
  vec3 ray = v_far.xyz / v_far.w - origin;
  vec2 inside = clip_to_box(origin, ray);
  float part = max(inside.y - inside.x, 0.0);
  float length_mm = part * length(ray);
  // A length that is a rounding more than whole steps has no sample more for it: rays along an axis often are such.
  float steps = length_mm / u_step_mm;
  float count = ceil(max(steps - 0.001, min(steps, 0.001)));
  float segment_mm = length_mm / max(count, 1.0);
  vec3 start = position(origin + ray * inside.x);
  vec3 stride = position(ray * (part / max(count, 1.0)));

  // Summing the depth and taking differences of exp(-depth) is front-to-back compositing with opacity
  // 1 - exp(-extinction * segment), without rounding each faint segment to float32's 1 - 6e-8.
  float depth = 0.0;
  float transmittance = 1.0;
  vec3 colour = vec3(0.0);
  //#part entry_start
  //#part first
  //#part skip_start
  //#part light_start
  //#part loop
    //#part medium
    //#part light
    depth += medium.a * segment_mm;
    float remaining = exp(-depth);
    colour += medium.rgb * (transmittance - remaining);
    transmittance = remaining;
    //#part termination
  }
  //#part loop_end
  $PICTURE = vec4(colour, 1.0 - transmittance);
}
