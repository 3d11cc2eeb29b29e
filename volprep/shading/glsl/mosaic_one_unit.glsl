//: The sampler of a mosaic in one texture.
uniform highp sampler2D u_volume;
