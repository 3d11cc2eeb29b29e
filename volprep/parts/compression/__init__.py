"""Compressed forms of levels: what each changes in the pictures, and whether it is taken."""
