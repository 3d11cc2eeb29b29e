"""Subjects of a validation: a package with its scan, drawn by the oracle."""
