"""Levels of the pyramid: which there are, the filters that make them, and the choice between filters."""
