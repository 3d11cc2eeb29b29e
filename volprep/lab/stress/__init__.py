"""Numerically hard cases: drawn on this driver, judged against the truth."""
