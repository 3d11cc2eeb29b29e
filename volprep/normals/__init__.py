"""Normals: gradients in the right unit and space, and what the bytes of their codes mean."""
