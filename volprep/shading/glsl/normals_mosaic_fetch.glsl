//: A fetch from a mosaic of normals in one texture.
return texture2D(u_normals, place);
