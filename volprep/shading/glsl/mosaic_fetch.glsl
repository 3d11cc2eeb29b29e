//: A fetch from a mosaic in one texture.
return texture2D(u_volume, place / MOSAIC);
