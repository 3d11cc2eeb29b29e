"""Compressed forms of levels: the picture error of each, and whether it is used."""
