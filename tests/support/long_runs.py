"""Long tests: `make test` runs a fixed share of them, `make test-long` all.

`@pytest.mark.long` keeps a test for `make test-long`; `@pytest.mark.long(keep=2)` leaves the first two of its
parametrised cases in `make test`. `@pytest.mark.longer` is for tests that use `LONG` or `share_of` and run in both.
"""

import os
from collections import Counter
from collections.abc import Iterable

import pytest

LONG = "VOLPREP_LONG" in os.environ
"""Whether `make test-long` runs."""
MARKERS = (
    "long(keep=0): runs in `make test-long`; its first `keep` cases run in `make test`, too",
    "longer: does more in `make test-long` than in `make test`",
)


def share_of(count: int, part: int = 4) -> int:
    """Return `count`, divided by `part` unless long tests run."""
    return count if LONG else -(-count // part)


def split(items: Iterable[pytest.Item]) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Return the tests of `make test`, and those that only `make test-long` runs."""
    short: list[pytest.Item] = []
    long: list[pytest.Item] = []
    cases: Counter[str] = Counter()
    for item in items:
        name = item.nodeid.partition("[")[0]
        cases[name] += 1
        mark = item.get_closest_marker("long")
        keeps = mark is None or cases[name] <= mark.kwargs.get("keep", 0)
        (short if keeps else long).append(item)
    return short, long
