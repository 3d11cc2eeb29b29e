"""Hybrid resolution."""
