"""Pictures of a package and of the truth, and their differences."""
