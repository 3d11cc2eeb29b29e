"""The volume package: manifest, reading, writing and checks. SPEC.md is its normative text."""
