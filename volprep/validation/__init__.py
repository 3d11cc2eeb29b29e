"""Proving a package: its pictures against the oracle on the scan that it was made from."""
