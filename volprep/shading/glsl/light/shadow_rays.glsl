//: Shadow rays through what absorbs (mobile volume rendering thesis, section 4.1). In: u_light_mm, u_step_mm,
//: clip_to_box, position. MEDIUM is the extinction of the segment of a ray whose middle is i, with `start` and
//: `stride` of the ray. Sections: start, before the loop, where a segment needs the value at its front; surface, in
//: place of all this, where light reaches a surface or does not. Words of it: ISOVALUE; VOXEL and POSITION_PER_MM of
//: the sampling.
// The part of the light that what lies between lets through to a place, box millimetres: steps as those of the pixel's
// ray.
float light_reaching(vec3 place_mm) {
  vec3 ray = u_light_mm - place_mm;
  vec2 inside = clip_to_box(place_mm, ray);
  float part = max(inside.y - inside.x, 0.0);
  float count = ceil(part * length(ray) / u_step_mm);
  float segment_mm = part * length(ray) / max(count, 1.0);
  vec3 start = position(place_mm + ray * inside.x);
  vec3 stride = position(ray * (part / max(count, 1.0)));
  float depth = 0.0;
  //#part shadow_start
  // Behind a depth of 14 is less than a millionth of the light.
  for (float i = 0.5; i < count && depth < 14.0; i++) {
    vec4 medium = $MEDIUM;
    depth += medium.a * segment_mm;
  }
  return exp(-depth);
}

//#section surface
// 1 where all samples from a place of the surface, box millimetres, to the light are on the viewer's side of it, else
// 0. Half a voxel is left out, so that rounding does not put a surface into its own shadow.
float light_reaching(vec3 place_mm, bool is_below) {
  vec3 voxel_mm = $VOXEL / $POSITION_PER_MM;
  vec3 ray = u_light_mm - place_mm;
  vec3 begin = place_mm + ray * min(0.5 * min(voxel_mm.x, min(voxel_mm.y, voxel_mm.z)) / length(ray), 1.0);
  ray = u_light_mm - begin;
  vec2 inside = clip_to_box(begin, ray);
  float part = inside.y - inside.x;
  if (part <= 0.0) {
    return 1.0;
  }
  float count = ceil(part * length(ray) / u_step_mm);
  vec3 start = position(begin + ray * inside.x);
  vec3 stride = position(ray * (part / count));
  for (float i = 0.0; i <= count; i++) {
    if ((stored_value(start + stride * i) < $ISOVALUE) != is_below) {
      return 0.0;
    }
  }
  return 1.0;
}

//#section start
$FRONT front = $FRONT_AT(start);
