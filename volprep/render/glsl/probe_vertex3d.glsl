#version 300 es
// Covers the picture with one triangle. a_ndc: corners in clip space.
in vec2 a_ndc;
void main() {
  gl_Position = vec4(a_ndc, 0.0, 1.0);
}
