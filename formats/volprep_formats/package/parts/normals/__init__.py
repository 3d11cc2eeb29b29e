"""Normals."""
