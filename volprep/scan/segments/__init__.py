"""Segments of a scan: brought onto its grid, as one label for each voxel."""
