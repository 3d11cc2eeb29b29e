"""The covering array: rows that have every pair of values, or every triple, that is not refused.

Finding the rows of pairs takes six seconds, so they are kept in rows.txt; `make combinations ARGS=--rows` writes them.
"""

from collections.abc import Iterable, Mapping
from itertools import combinations, product
from pathlib import Path

from .factors import DEFAULTS, FACTORS, REFUSED, Row, row_of

Combination = frozenset[tuple[str, str]]
"""Values of some factors: pairs of factor and value."""


ROWS = Path(__file__).with_name("rows.txt")
"""Names of the rows of all pairs."""


def rows_of_pairs() -> list[Row]:
    """Return the kept rows of all pairs."""
    return [row_of(name) for name in ROWS.read_text(encoding="utf-8").split()]


def is_refused(values: Mapping[str, str]) -> bool:
    """Return whether the values of some factors contain a refused combination."""
    return any(all(values.get(factor) in wanted for factor, wanted in rule.items()) for rule in REFUSED)


def covering_array(strength: int = 2) -> list[Row]:
    """Return rows without refused combinations that have every possible combination of `strength` values.

    It begins with the kept rows, so that a new rule changes few of them.
    """
    from covertable import make  # only for this

    kept = [row for row in rows_of_pairs() if not is_refused(row)]
    return make({**FACTORS}, strength=strength, presets=kept, constraints=[_without(rule) for rule in REFUSED])


def _without(rule: Mapping[str, tuple[str, ...]]) -> dict[str, object]:
    """Return a condition of covertable that is met where a rule does not refuse."""
    others = [[each for each in FACTORS[factor] if each not in values] for factor, values in rule.items()]
    conditions = [{"operator": "in", "left": factor, "values": left} for factor, left in zip(rule, others, strict=True)]
    return {"operator": "or", "conditions": conditions}


def combinations_of(row: Row, strength: int = 2) -> set[Combination]:
    """Return the combinations of `strength` values of a row."""
    return {frozenset(each) for each in combinations(row.items(), strength)}


def all_combinations(strength: int = 2) -> Iterable[Combination]:
    """Return every combination of `strength` values of different factors."""
    for factors in combinations(FACTORS, strength):
        for values in product(*(FACTORS[each] for each in factors)):
            yield frozenset(zip(factors, values, strict=True))


def alone(rows: Iterable[Row], strength: int = 2) -> list[Row]:
    """Return a row for each combination that no row of an array has, and for each of a rule of more factors.

    It has their values, and defaults elsewhere.
    """
    had = set().union(*(combinations_of(row, strength) for row in rows))
    left = [each for each in all_combinations(strength) if each not in had]
    for rule in REFUSED:
        if len(rule) > strength:
            left += [frozenset(zip(rule, values, strict=True)) for values in product(*rule.values())]
    return [DEFAULTS | dict(each) for each in left]
