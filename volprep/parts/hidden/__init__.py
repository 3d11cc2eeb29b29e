"""Voxels that no picture can show: which they are, and texels in which they have one value."""
