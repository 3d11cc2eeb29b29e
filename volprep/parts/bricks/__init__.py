"""Levels as bricks with ghost voxels in one 3D texture."""
