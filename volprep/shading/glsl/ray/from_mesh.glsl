//: Rays that begin at proxy geometry. In: what vertex/mesh.glsl gives for each pixel. Sections: ends
//: of the ray; start, the first sample.
// Where the pixel's ray meets the mesh, box millimetres; and x, y and w of its clip coordinates.
$VARYING_IN vec3 v_entry;
$VARYING_IN vec3 v_clip;
uniform mat4 u_box_from_clip;
// Rays begin this much before the mesh: rounding, and the resolution of the depth buffer, is less.
const float ENTRY_MARGIN_MM = $ENTRY_MARGIN_MM;
// An end of the pixel's ray, homogeneous box millimetres: on the near plane at depth -1, on the far plane at depth 1.
// Interpolated between the corners of a small triangle it would be less exact.
vec4 ray_end(float depth) {
  return u_box_from_clip * vec4(v_clip.xy / v_clip.z, depth, 1.0);
}
//#section ends
vec4 near_end = ray_end(-1.0);
vec4 far_end = ray_end(1.0);
//#section start
// The first sample that is taken: those before the mesh see nothing, and the others stay where they are.
float met = dot(v_entry - origin, ray) / dot(ray, ray) - ENTRY_MARGIN_MM / length(ray);
float entered = 0.5 + max(floor((met - inside.x) / max(part, 1e-9) * count - 0.5), 0.0);
