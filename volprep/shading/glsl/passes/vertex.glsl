//: Vertex shader of both passes over the faces of the box, both dialects, highp throughout. In: a_corner, a corner of
//: the box, 0 or 1 along each axis; u_clip_from_box, 4x4. Out: v_at, box millimetres; v_clip, x, y and w of clip
//: coordinates. Slot: place, the section whole or clipped.
// A face of the volume's box.
$ATTRIBUTE vec3 a_corner;
uniform mat4 u_clip_from_box;
const vec3 BOX_MM = $BOX_MM;
$VARYING_OUT vec3 v_at;
$VARYING_OUT vec3 v_clip;

void main() {
  v_at = a_corner * BOX_MM;
  vec4 at = u_clip_from_box * vec4(v_at, 1.0);
  v_clip = at.xyw;
  //#part place
}
//#section whole
// Rays are cut at the near and the far plane; faces are not.
gl_Position = vec4(at.xy, 0.0, at.w);
//#section clipped
gl_Position = at;
