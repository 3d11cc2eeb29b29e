"""Order of convergence of an error as steps get smaller, measured where it is settled.

An error e = C h^p shows as a straight line in logarithms. Coarse steps may not be on that line yet: if one step already
hides everything behind it, the error hardly changes (a plateau). Fine steps leave it again when the error of the truth
or of the arithmetic dominates. So the order is fitted on the finest run of refinements whose slopes agree, and the
steps before it are reported.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class OrderFit:
    """Fit of the order of convergence of an error."""

    order: float | None
    """Slope of log error over log step in the settled window; None if no window settles."""
    first: int
    """Index of the coarsest step in the window: that many steps before it are not settled yet."""
    last: int
    """Index of the finest step in the window; finer ones are below the floor or unsettled."""


def fit_order(
    steps: Sequence[float], errors: Sequence[float], floor: float = 0.0, agreement: float = 0.15, least: int = 3
) -> OrderFit:
    """Fit the order to errors of a sequence of ever smaller steps.

    Parameters
    ----------
    steps
        Step sizes, falling.
    errors
        Error at each step.
    floor
        Errors up to this are noise: the sequence ends before the first of them.
    agreement
        Slopes between neighbouring steps agree when all of them are this close to their mean.
    least
        Refinements that a window needs.

    Returns
    -------
    OrderFit
        The finest window of agreeing slopes, as long as it can be, and its least-squares slope.
    """
    above = [index for index, error in enumerate(errors) if error <= floor]
    count = above[0] if above else len(errors)
    x, y = np.log(np.array(steps[:count])), np.log(np.array(errors[:count]))
    slopes = np.diff(y) / np.diff(x)

    def agree(first: int, last: int) -> bool:
        window = slopes[first:last]
        return bool(np.all(np.abs(window - window.mean()) <= agreement))

    for last in range(len(slopes), least - 1, -1):
        if not agree(last - least, last):
            continue
        first = last - least
        while first > 0 and agree(first - 1, last):
            first -= 1
        order = float(np.polyfit(x[first : last + 1], y[first : last + 1], 1)[0])
        return OrderFit(order=order, first=first, last=last)
    return OrderFit(order=None, first=count, last=count)
