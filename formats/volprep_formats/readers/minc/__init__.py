"""Volumes of the MINC toolkit."""
