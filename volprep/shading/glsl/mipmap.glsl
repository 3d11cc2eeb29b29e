//: In: u_mipmap, from 0 to the number of mipmaps less 1; the sampler has LINEAR_MIPMAP_LINEAR.
// Which mipmap is read; between two whole numbers both are mixed.
uniform float u_mipmap;
