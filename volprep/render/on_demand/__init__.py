"""Pictures of a package from those of its bricks that a device holds: which ones, and what the others would change."""
