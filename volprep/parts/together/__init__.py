"""Several channels in one picture, and in common texels."""
