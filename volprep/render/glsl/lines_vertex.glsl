#version 100
// Lines between places in the volume's box. a_position: millimetres.
attribute vec3 a_position;
uniform mat4 u_clip_from_box;
void main() {
  gl_Position = u_clip_from_box * vec4(a_position, 1.0);
}
