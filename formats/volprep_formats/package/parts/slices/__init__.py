"""Stacks of slices."""
