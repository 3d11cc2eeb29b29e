"""Helpers of the transfer-function readers: parse finite numbers, and merge two functions."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

Knot = tuple[float, ...]
"""A value, and the function's components there."""


MOST_POINTS = 4096
"""Points of a function, or labels, that a file may have."""


@dataclass(frozen=True)
class FilePoint:
    """One point."""

    value: float
    """Physical value."""
    colour: tuple[float, float, float]
    """sRGB, 0 to 1."""
    opacity: float
    """Opacity of a unit of length, 0 to 1."""


def number(text: object) -> float:
    """Return a finite number. Raises ValueError for anything else, a truth value included."""
    if isinstance(text, bool) or not isinstance(text, (str, int, float)):
        msg = f"{str(text)[:40]!r} is not a number"
        raise ValueError(msg)  # noqa: TRY004 - a wrong file, not a wrong call
    try:
        found = float(text)
    except (ValueError, OverflowError):
        found = math.nan
    if not math.isfinite(found) or abs(found) > 1e38:
        msg = f"{str(text)[:40]!r} is not a number"
        raise ValueError(msg)
    return found


def knots(numbers: Sequence[float], width: int, what: str) -> list[Knot]:
    """Split a flat list into knots of `width` numbers, in ascending order. Raises ValueError if it cannot be split."""
    if len(numbers) > MOST_POINTS * width:
        msg = f"{what}: more than {MOST_POINTS} points"
        raise ValueError(msg)
    if not numbers or len(numbers) % width:
        msg = f"{what}: {len(numbers)} numbers, expected some, and a multiple of {width}"
        raise ValueError(msg)
    found = [tuple(numbers[i : i + width]) for i in range(0, len(numbers), width)]
    for index, (lower, upper) in enumerate(pairwise(found), start=1):
        if upper[0] < lower[0]:
            msg = f"{what}: point {index + 1} stands before point {index}"
            raise ValueError(msg)
    for index, knot in enumerate(found, start=1):
        if not all(0.0 <= value <= 1.0 for value in knot[1:]):
            msg = f"{what}: point {index} has a colour or opacity outside 0 to 1"
            raise ValueError(msg)
    return found


def joined(colours: Sequence[Knot], opacities: Sequence[Knot]) -> list[FilePoint]:
    """Put a colour function (value, r, g, b) and an opacity function (value, opacity) together at all their points."""
    points = []
    for value in sorted({knot[0] for knot in (*colours, *opacities)}):
        sides = []
        for above in (False, True):
            red, green, blue = _limit(colours, value, above=above)
            (opacity,) = _limit(opacities, value, above=above)
            sides.append(FilePoint(value, (red, green, blue), opacity))
        points += sides[:1] if sides[0] == sides[1] else sides
    return points


def _limit(function: Sequence[Knot], value: float, *, above: bool) -> Knot:
    """Return the limit of a function at a value, from below or from above."""
    values = [knot[0] for knot in function]
    if above:
        after = bisect_right(values, value)
        if after and values[after - 1] == value:
            return function[after - 1][1:]
    else:
        after = bisect_left(values, value)
        if after < len(values) and values[after] == value:
            return function[after][1:]
    if after in {0, len(values)}:
        return function[min(after, len(values) - 1)][1:]
    low, high = function[after - 1], function[after]
    share = (value - low[0]) / (high[0] - low[0])
    return tuple(a + share * (b - a) for a, b in zip(low[1:], high[1:], strict=True))
