"""Level 0 in sub-volumes."""
