"""Ground truth: the oracle, fields with known answers, differences of pictures, orders of convergence."""
