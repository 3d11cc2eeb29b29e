"""How much of a long random test runs: a fixed share in `make test`, all of it in `make test-long`."""

import os

LONG = "VOLPREP_LONG" in os.environ
"""Whether `make test-long` runs."""


def share_of(count: int, part: int = 4) -> int:
    """Return `count`, divided by `part` unless long tests run."""
    return count if LONG else -(-count // part)
