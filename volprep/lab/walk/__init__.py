"""Pictures of a walk through a package: levels, sub-volumes, cuts and blocks."""
