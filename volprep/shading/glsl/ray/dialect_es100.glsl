//: GLSL ES 1.00: OpenGL ES 2.0 and WebGL 1. highp is optional in its fragment shaders.
#ifndef GL_FRAGMENT_PRECISION_HIGH
#error mediump has 10 bits: too few for the positions along a ray and the texels of a mosaic
#endif
precision highp float;
