"""Levels as 2D mosaics, for devices without 3D textures."""
