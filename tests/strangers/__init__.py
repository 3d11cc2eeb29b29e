"""Scans that volprep was not written for: each is built as a new user would, and what came of it is put in a table."""
