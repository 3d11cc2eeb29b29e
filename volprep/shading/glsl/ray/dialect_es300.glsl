//: GLSL ES 3.00: OpenGL ES 3.0 and WebGL 2.
precision highp float;
out vec4 picture;
