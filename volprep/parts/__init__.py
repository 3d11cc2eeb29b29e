"""One room for each part that a package may have: its decision, its algorithm, its stage."""
