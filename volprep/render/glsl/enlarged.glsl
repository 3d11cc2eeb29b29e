#version 100
// A small picture as large as the one that is drawn. u_small: premultiplied, LINEAR, CLAMP_TO_EDGE.
precision mediump float;
uniform sampler2D u_small;
varying highp vec2 v_at;
void main() {
  gl_FragColor = texture2D(u_small, v_at);
}
