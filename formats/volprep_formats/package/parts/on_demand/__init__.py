"""Bricks on demand."""
