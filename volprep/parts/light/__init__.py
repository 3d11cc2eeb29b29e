"""Light that is computed once: its decision, its solver, its stage."""
