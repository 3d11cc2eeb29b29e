"""Hybrid resolution: a small picture of the volume below lines with all pixels."""
