"""Compressed forms."""
