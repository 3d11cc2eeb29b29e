"""Hybrid resolution: the volume with few pixels, lines with all."""
