"""Statements of how near pictures are to the scan."""
