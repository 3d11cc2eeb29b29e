//: Vertex shader of lines. In: a_position, box millimetres; u_clip_from_box, 4x4.
// Lines between places in the volume's box.
$ATTRIBUTE vec3 a_position;
uniform mat4 u_clip_from_box;
void main() {
  gl_Position = u_clip_from_box * vec4(a_position, 1.0);
}
