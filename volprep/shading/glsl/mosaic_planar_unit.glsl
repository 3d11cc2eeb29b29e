//: Channels are numbered through all textures: four of them make the next texture's tiles.
float texture_before = floor((channel + 0.5) / 4.0);
channel -= texture_before * 4.0;
tile += texture_before * $TILES;
