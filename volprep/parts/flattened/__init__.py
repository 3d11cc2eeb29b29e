"""Voxels that no picture can show get one value, so that textures compress better on their way to an app."""
