//: Which of several textures has a tile of normals. In: tile, numbered through all textures.
float unit = floor((tile + 0.5) / $NORMAL_TILES);
tile -= unit * $NORMAL_TILES;
