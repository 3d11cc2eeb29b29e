"""Codes of 8 or 16 bits for physical values: bits and window, and the stage that quantizes."""
