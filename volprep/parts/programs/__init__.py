"""Shader programs: which there are, and the stage that writes their text."""
