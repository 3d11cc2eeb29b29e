//: Vertex shader of the small picture. In: a_ndc, corners in clip space. Out: v_at, its texture coordinates.
// Covers the picture with one triangle.
$ATTRIBUTE vec2 a_ndc;
$VARYING_OUT vec2 v_at;
void main() {
  v_at = 0.5 * a_ndc + 0.5;
  gl_Position = vec4(a_ndc, 0.0, 1.0);
}
