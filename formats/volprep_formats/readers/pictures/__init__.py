"""Stacks of pictures of any format."""
