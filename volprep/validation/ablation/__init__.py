"""Leaving out, proved: what each item of a package gains, and what each that was left out would change."""
