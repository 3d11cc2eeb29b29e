"""Levels as mipmaps of one texture."""
