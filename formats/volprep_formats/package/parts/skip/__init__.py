"""Empty-space skipping."""
