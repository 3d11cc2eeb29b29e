"""All levels in bricks, which readers fetch as a view needs them."""
