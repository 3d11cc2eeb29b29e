"""Transfer functions: from control points to what the GPU reads."""
