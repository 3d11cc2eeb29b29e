"""The Pareto front of a curve: variants that no other beats."""

import math
from collections.abc import Sequence

from volprep.lab.curves.records import Cost, CurvePoint, plotted_cost

_SAME_ERROR = 1.02
"""Ratio of errors that count as equal: another view may order them the other way round."""
_SAME_COST = 1.1
"""Ratio of costs that count as equal: medians of nine draws, and builds, scatter by so much."""


def with_front(points: Sequence[CurvePoint], cost: Cost) -> tuple[CurvePoint, ...]:
    """Mark the points that no other point beats."""
    return tuple(
        point.model_copy(update={"on_front": not any(beats(other, point, cost) for other in points)})
        for point in points
    )


def beats(one: CurvePoint, other: CurvePoint, cost: Cost) -> bool:
    """Return whether `one` is better than `other` in cost or in error, and no worse in both.

    Costs and errors count in classes of nearly equal ones, so that what beats a point beats all that this point beats.
    Quartiles that overlap are no such order: on a busy machine the slowest step alone was on the front.
    """
    own, others = _classes(one, cost), _classes(other, cost)
    return own != others and own[0] <= others[0] and own[1] <= others[1]


def _classes(point: CurvePoint, cost: Cost) -> tuple[int, int]:
    return _class(plotted_cost(point, cost), _SAME_COST), _class(point.errors.rmse, _SAME_ERROR)


def _class(value: float, ratio: float) -> int:
    return round(math.log(max(value, 1e-9), ratio))
