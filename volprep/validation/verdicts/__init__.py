"""Verdicts, and the words and codes for them."""
