"""A scan with its segments in one picture."""
