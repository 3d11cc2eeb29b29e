#ifndef GL_FRAGMENT_PRECISION_HIGH
#error mediump has 10 bits: too few for the positions along a ray and the texels of a mosaic
#endif
precision highp float;
