"""Level 0 in sub-volumes that share voxels, and boxes cut from a package."""
