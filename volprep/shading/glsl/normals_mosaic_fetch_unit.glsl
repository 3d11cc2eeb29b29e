//: A fetch from a mosaic of normals in several textures.
return normal_unit_texel(unit, place);
