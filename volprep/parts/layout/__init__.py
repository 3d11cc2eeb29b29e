"""Levels and textures of a channel: which levels a package holds, and in which form."""
