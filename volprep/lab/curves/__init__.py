"""Curves of choices: everything that trades accuracy for time or bytes, measured on one scan."""
