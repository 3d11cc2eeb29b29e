"""Fidelity of a package's pictures to the scan."""
