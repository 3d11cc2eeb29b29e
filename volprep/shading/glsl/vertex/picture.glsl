//: Vertex shader of all ray casters that begin at the box, both dialects, highp throughout.
//: In: a_ndc, clip coordinates of the corners; u_box_from_clip, 4x4. Out: v_near and v_far, homogeneous millimetres.
// A triangle that covers the picture. Gives every pixel its ray: homogeneous box positions (millimetres along the
// volume's axes, its corner at 0) on the near and the far plane. a_ndc is (-1, -1), (3, -1), (-1, 3).
$ATTRIBUTE vec2 a_ndc;
uniform mat4 u_box_from_clip;
$VARYING_OUT vec4 v_near;
$VARYING_OUT vec4 v_far;

void main() {
  v_near = u_box_from_clip * vec4(a_ndc, -1.0, 1.0);
  v_far = u_box_from_clip * vec4(a_ndc, 1.0, 1.0);
  gl_Position = vec4(a_ndc, 0.0, 1.0);
}
