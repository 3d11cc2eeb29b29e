"""Normals: directions of gradients, for light."""
