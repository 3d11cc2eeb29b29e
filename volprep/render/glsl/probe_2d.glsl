#version 100
// Draws what a 2D texture gives at u_first, in the left pixel, and u_step further on in each pixel to the right.
// u_first, u_step: texture coordinates. A value of u_middle becomes 0.5, and u_span apart is 1 apart in the picture.
precision highp float;
uniform sampler2D u_texels;
uniform vec3 u_first;
uniform vec3 u_step;
uniform float u_middle;
uniform float u_span;
void main() {
  vec3 at = u_first + u_step * floor(gl_FragCoord.x);
  gl_FragColor = (texture2D(u_texels, at.xy) - u_middle) / u_span + 0.5;
}
