//: Second pass, on the back faces: where the ray leaves the box is interpolated, where it enters is read from the
//: target of the first pass. Sections: ends of the ray; inside; millimetres and fraction, how the first pass says
//: where.
// Where the pixel's ray leaves the box, box millimetres; and x, y and w of its clip coordinates.
$VARYING_IN vec3 v_at;
$VARYING_IN vec3 v_clip;
uniform highp sampler2D u_entry;
uniform mat4 u_box_from_clip;
const vec3 BOX_MM = $BOX_MM;
// An end of the pixel's ray, homogeneous box millimetres: on the near plane at depth -1, on the far plane at depth 1.
vec4 ray_end(float depth) {
  return u_box_from_clip * vec4(v_clip.xy / v_clip.z, depth, 1.0);
}
//#section ends
vec4 near_end = ray_end(-1.0);
vec4 far_end = ray_end(1.0);
//#section inside
float leaves = min(dot(v_at - origin, ray) / dot(ray, ray), 1.0);
// Where no front face was drawn, the ray begins inside the box, or misses it by a rounding.
bool begins_inside = all(greaterThan(origin, vec3(0.0))) && all(lessThan(origin, BOX_MM));
float enters = begins_inside ? 0.0 : leaves;
vec4 entry = $TEXTURE_2D(u_entry, 0.5 * v_clip.xy / v_clip.z + 0.5);
if (entry.a > 0.5) {
  //#part entry
}
vec2 inside = vec2(enters, leaves);
//#section millimetres
enters = max(dot(entry.xyz - origin, ray) / dot(ray, ray), 0.0);
//#section fraction
enters = dot(entry.rgb, vec3(1.0, 1.0 / 255.0, 1.0 / 65025.0));
