"""Phantoms of combined features: each was built by defaults once, and failed its own verdict or lost what it shows."""
