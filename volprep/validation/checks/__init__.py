"""Checks of a package beside its pictures."""
