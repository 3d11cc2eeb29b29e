//: Channels on several grids in one picture. Positions are box millimetres of the picture. Sections: place and start,
//: of each channel $OF, whose box has the size $EXTENT_MM. Places between its samples are start$OF + stride$OF * i in
//: texture coordinates, and it is met where i is within$OF.
vec3 position(vec3 box_mm) {
  return box_mm;
}
// The numbers i between which start + stride * i is in a box from 0 to extent_mm.
vec2 numbers_within(vec3 start, vec3 stride, vec3 extent_mm) {
  // Division by zero is undefined in GLSL ES; a slope of 1e-7 moves the ray by less than float32 resolves.
  vec3 least = vec3(1e-7 * length(stride));
  vec3 slope = mix(stride, least, vec3(lessThan(abs(stride), least)));
  vec3 low = -start / slope;
  vec3 high = (extent_mm - start) / slope;
  vec3 enter = min(low, high);
  vec3 leave = max(low, high);
  return vec2(max(enter.x, max(enter.y, enter.z)), min(leave.x, min(leave.y, leave.z)));
}
// The part of the segment around sample i that is within.
float share(float i, vec2 within) {
  return clamp(min(i + 0.5, within.y) - max(i - 0.5, within.x), 0.0, 1.0);
}
// Where a run from sample i on ends, so that all its segments are whole, or it is a single one that a face cuts.
float end_of_run(float i, vec2 within) {
  return i - 0.5 < within.x || i + 0.5 > within.y ? i + 1.0 : floor(within.y) + 0.5;
}
//#section place
uniform mat4 u_medium${OF}_from_box;
uniform vec3 u_texture_from_medium$OF;
// Factor of the extinction, 1 unless an app fades the medium.
uniform float u_opacity$OF;
vec3 start$OF;
vec3 stride$OF;
vec2 within$OF;
// Factor of the extinction in a run of samples.
float weight$OF;
void begin$OF(vec3 start, vec3 stride) {
  vec3 start_mm = (u_medium${OF}_from_box * vec4(start, 1.0)).xyz;
  vec3 stride_mm = (u_medium${OF}_from_box * vec4(stride, 0.0)).xyz;
  within$OF = numbers_within(start_mm, stride_mm, $EXTENT_MM);
  start$OF = start_mm * u_texture_from_medium$OF;
  stride$OF = stride_mm * u_texture_from_medium$OF;
}
//#section start
begin$OF(start, stride);
