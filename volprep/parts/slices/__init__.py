"""Stacks of slices, for devices without shaders."""
