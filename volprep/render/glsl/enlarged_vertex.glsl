#version 100
// Covers the picture with one triangle. a_ndc: corners in clip space.
attribute vec2 a_ndc;
varying highp vec2 v_at;
void main() {
  v_at = 0.5 * a_ndc + 0.5;
  gl_Position = vec4(a_ndc, 0.0, 1.0);
}
