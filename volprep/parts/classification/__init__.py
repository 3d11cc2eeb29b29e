"""How samples become colours: lookup tables, pre-integrated tables, palettes, classified voxels."""
