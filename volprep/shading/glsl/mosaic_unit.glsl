//: Which of several textures has a tile. In: tile, numbered through all textures.
float unit = floor((tile + 0.5) / $TILES);
tile -= unit * $TILES;
