//: Vertex shader of the pass over proxy geometry, both dialects, highp throughout.
//: In: a_position, a vertex of the mesh; u_box_from_mesh, millimetres of its units; u_clip_from_box, 4x4.
//: Out: v_at, box millimetres; v_clip, x, y and w of clip coordinates.
// The faces of a mesh around what can be seen.
$ATTRIBUTE vec3 a_position;
uniform vec3 u_box_from_mesh;
uniform mat4 u_clip_from_box;
const vec3 BOX_MM = $BOX_MM;
$VARYING_OUT vec3 v_at;
$VARYING_OUT vec3 v_clip;

void main() {
  vec3 at = a_position * u_box_from_mesh;
  // A voxel outwards where the mesh ends with the volume, so that no pixel of its border is lost; rays are clipped.
  vec3 half_unit = 0.5 * u_box_from_mesh;
  v_at = at + (step(BOX_MM - half_unit, at) - step(at, half_unit)) * 4.0 * u_box_from_mesh;
  gl_Position = u_clip_from_box * vec4(v_at, 1.0);
  v_clip = gl_Position.xyw;
}
