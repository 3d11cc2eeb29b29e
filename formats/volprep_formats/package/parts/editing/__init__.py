"""Joint histograms, for users who edit transfer functions."""
