//: The sampler of a mosaic of normals in one texture.
uniform highp sampler2D u_normals;
