#version 300 es
// As probe_2d.glsl, for a 3D texture.
precision highp float;
precision highp sampler3D;
uniform sampler3D u_texels;
uniform vec3 u_first;
uniform vec3 u_step;
uniform float u_middle;
uniform float u_span;
out vec4 drawn;
void main() {
  vec3 at = u_first + u_step * floor(gl_FragCoord.x);
  drawn = (texture(u_texels, at) - u_middle) / u_span + 0.5;
}
