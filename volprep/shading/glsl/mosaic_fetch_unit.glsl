//: A fetch from a mosaic in several textures.
return unit_texel(unit, place / MOSAIC);
