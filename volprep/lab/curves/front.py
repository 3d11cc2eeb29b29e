"""The Pareto front of a curve: variants that no other beats, within the uncertainty of times and errors."""

from collections.abc import Sequence

from volprep.lab.curves.records import Cost, CurvePoint, Range, cost_range, plotted_cost

_SAME_ERROR = 0.02
"""Errors that differ by less than a fiftieth count as equal: another view may order them the other way round."""


def with_front(points: Sequence[CurvePoint], cost: Cost) -> tuple[CurvePoint, ...]:
    """Mark the points that no other point beats."""
    return tuple(
        point.model_copy(update={"on_front": not any(beats(other, point, cost) for other in points)})
        for point in points
    )


def beats(one: CurvePoint, other: CurvePoint, cost: Cost) -> bool:
    """Return whether `one` is clearly better than `other` in cost or in error, costs no more, and has no larger error.

    Costs are clearly apart if their quartiles are, errors if they differ by a fiftieth. What costs more in the median
    beats nothing that is cheaper, however far its quartiles reach: on a busy machine a step of 354 ms beat one of 80.
    """
    costs = cost_range(one, cost), cost_range(other, cost)
    errors = _error_range(one), _error_range(other)
    better = _is_less(*costs) or _is_less(*errors)
    return better and plotted_cost(one, cost) <= plotted_cost(other, cost) and not _is_less(*reversed(errors))


def _error_range(point: CurvePoint) -> Range:
    rmse = point.errors.rmse
    return rmse * (1 - _SAME_ERROR / 2), rmse * (1 + _SAME_ERROR / 2)


def _is_less(one: Range, other: Range) -> bool:
    """Return whether one range lies below the other."""
    return one[1] < other[0]
