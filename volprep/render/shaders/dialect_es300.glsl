precision highp float;
out vec4 picture;
