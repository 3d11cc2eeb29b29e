"""Derive everything that follows exactly from the scan again, and compare it with the package."""
