"""Loops that take several samples in each turn, and read labels, which change slowly, once for all of them.

On Mesa's software driver, which runs both sides of every branch, a fetch that a condition leaves out for every second
sample takes as long as one for each. Light that was computed once is still read for each sample: turns of two samples
cost what half of its fetches save (1.38 in place of 1.39 times the unlit picture).
"""

from collections.abc import Iterable

from volprep.shading.compose import literal
from volprep.shading.feature import Feature
from volprep.shading.walk import Walk

_PART = "ray/groups"
SINGLE_SAMPLES = Feature(
    slots={"turn": f"{_PART}:one", "run": f"{_PART}:run_of_one", "within": None}, offers={"I": "i", "NEXT": "++"}
)
"""Loops that take one sample in each turn, from the first one on: FROM is FIRST."""


def group_size(longest: Iterable[float]) -> int:
    """Return how many samples a group may have that is no longer than so many steps on any level: 4, 2, or 1.

    Two samples may be twice as far apart as that, since such steps make errors of their own. All sizes divide the
    samples between two looks at a skip table, and the samples of a slab.
    """
    # Rounding, as in 4 * 0.1 * 2.5, takes no sample away.
    steps = 1.001 * min(longest)
    return 4 if steps >= 4.0 else 2 if steps >= 1.0 else 1


def in_groups(walk: Walk, size: int) -> Feature:
    """Return loops that take `size` samples in each turn, whose first is the first of the ray, or every size-th."""
    first = walk.feature.offers["FIRST"]
    start = first if first == "0.5" else f"{first} - mod({first} - 0.5, {literal(size)})"
    return Feature(
        slots={"turn": _PART, "run": f"{_PART}:run", "within": f"{_PART}:within"},
        offers={
            "I": "first",
            "NEXT": f" += {literal(size)}",
            "FROM": start,
            "GROUP": str(size),
            "IN_GROUP": literal(size),
            "HALF_GROUP": literal(0.5 * (size - 1)),
        },
    )
