"""Surfaces of a package as meshes, and how far they are from what the volume shows."""
