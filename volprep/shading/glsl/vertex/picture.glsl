//: Vertex shader of all ray casters, both dialects, highp throughout. In: a_ndc, clip coordinates of the corners;
//: u_box_from_clip, 4x4. Out: v_near and v_far, homogeneous millimetres; v_place, where a section of slots
//: place_declared and place gives it.
// A triangle that covers the picture. Gives every pixel its ray: homogeneous box positions (millimetres along the
// volume's axes, its corner at 0) on the near and the far plane. a_ndc is (-1, -1), (3, -1), (-1, 3).
$ATTRIBUTE vec2 a_ndc;
uniform mat4 u_box_from_clip;
$VARYING_OUT vec4 v_near;
$VARYING_OUT vec4 v_far;
//#part place_declared

void main() {
  v_near = u_box_from_clip * vec4(a_ndc, -1.0, 1.0);
  v_far = u_box_from_clip * vec4(a_ndc, 1.0, 1.0);
  //#part place
  gl_Position = vec4(a_ndc, 0.0, 1.0);
}
//#section place_declared
$VARYING_OUT vec2 v_place;
//#section place
v_place = 0.5 * a_ndc + 0.5;
