"""Several channels in one picture."""
