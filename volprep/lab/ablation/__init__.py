"""Ablation: the gain of each item of a package, and the change by each item that was left out."""
