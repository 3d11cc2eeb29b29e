"""Texture files: containers and compressed forms."""
