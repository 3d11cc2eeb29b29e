"""Techniques of drawing a volume, one file each: what is special about it, in the shaders and beside them."""
