//: Vertex shader of ray casters that begin at proxy geometry, both dialects, highp throughout; of both passes.
//: In: a_position, a vertex of the mesh; u_box_from_mesh, millimetres of its units; u_clip_from_box and u_box_from_clip,
//: 4x4, inverse to each other. Out: v_entry, box millimetres; v_near and v_far, homogeneous box millimetres.
// The faces of a mesh around what can be seen. Each pixel gets where its ray meets the nearest one, and the ray: box
// positions on the near and the far plane.
$ATTRIBUTE vec3 a_position;
uniform vec3 u_box_from_mesh;
uniform mat4 u_clip_from_box;
uniform mat4 u_box_from_clip;
const vec3 BOX_MM = $BOX_MM;
$VARYING_OUT vec3 v_entry;
$VARYING_OUT vec4 v_near;
$VARYING_OUT vec4 v_far;
// Both passes must find the same depth.
invariant gl_Position;

void main() {
  vec3 at = a_position * u_box_from_mesh;
  // A voxel outwards where the mesh ends with the volume, so that no pixel is lost at its border; rays are clipped there.
  vec3 half_unit = 0.5 * u_box_from_mesh;
  v_entry = at + (step(BOX_MM - half_unit, at) - step(at, half_unit)) * 4.0 * u_box_from_mesh;
  vec4 clip = u_clip_from_box * vec4(v_entry, 1.0);
  v_near = u_box_from_clip * vec4(clip.xy, -clip.w, clip.w);
  v_far = u_box_from_clip * clip.xyww;
  gl_Position = clip;
}
