//: First pass: where rays enter or leave the box. Slots: dialect; declared, and position: sections of the form of the
//: target, millimetres, colour or fraction.
//#part dialect
$VARYING_IN vec3 v_at;
//#part declared

void main() {
  //#part position
}
//#section millimetres
// Box millimetres, in a target of floats.
$PICTURE = vec4(v_at, 1.0);
//#section colour_declared
const vec3 BOX_MM = $BOX_MM;
//#section colour
// A colour of 8 bits: the position is rounded to 1/255 of the box.
$PICTURE = vec4(v_at / BOX_MM, 1.0);
//#section fraction_declared
$VARYING_IN vec3 v_clip;
uniform mat4 u_box_from_clip;
vec3 ray_end(float depth) {
  vec4 at = u_box_from_clip * vec4(v_clip.xy / v_clip.z, depth, 1.0);
  return at.xyz / at.w;
}
//#section fraction
// The fraction of the ray from the near to the far plane, in 24 bits: red holds the first 8.
vec3 origin = ray_end(-1.0);
vec3 ray = ray_end(1.0) - origin;
float fraction = clamp(dot(v_at - origin, ray) / dot(ray, ray), 0.0, 0.9999999);
vec3 digits = fract(fraction * vec3(1.0, 255.0, 65025.0));
$PICTURE = vec4(digits - digits.yzz * vec3(1.0 / 255.0, 1.0 / 255.0, 0.0), 1.0);
