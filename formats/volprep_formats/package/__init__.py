"""The volume package: manifest, reading, writing and checks. formats/spec is its normative text."""
