"""Ground truth: the oracle, fields with known answers, how far pictures are apart, orders of convergence."""
