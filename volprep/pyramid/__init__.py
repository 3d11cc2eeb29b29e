"""Coarser levels of a volume: the filters that make them."""
