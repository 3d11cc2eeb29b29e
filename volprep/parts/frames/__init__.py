"""Frames of a time series."""
