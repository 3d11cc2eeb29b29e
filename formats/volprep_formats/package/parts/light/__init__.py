"""Records of precomputed light in a package."""
