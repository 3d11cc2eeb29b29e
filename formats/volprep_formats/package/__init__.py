"""The volume package: its manifest, how it is read, written and checked. SPEC.md is its normative text."""
