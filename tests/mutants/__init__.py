"""Planted bugs: who finds them. `make mutants` runs all of them."""
