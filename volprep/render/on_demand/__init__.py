"""Pictures of a package from the bricks that a device holds: which ones, and the changes that the others would make."""
