"""Everything that volprep reads or writes: source formats, textures, meshes and the volume package."""
