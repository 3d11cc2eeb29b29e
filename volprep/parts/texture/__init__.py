"""Levels as 3D textures, and as mipmaps of one."""
