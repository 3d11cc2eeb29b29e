"""Empty-space skipping: which blocks of a level a transfer function leaves empty, and how far a ray may jump there."""
