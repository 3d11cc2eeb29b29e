"""Times of draws, measured in turns, so that other load on the machine disturbs all of them equally."""

from collections.abc import Callable, Mapping
from typing import TypeVar

from volprep.render.timing import Spread
from volprep.validation.results.seen import NonNegative
from volprep_formats.grid import Count
from volprep_formats.record import Record

LEAST_DRAWS = 7
"""Draws of each thing. Of seven the quartiles are draws, and no single one decides."""

_Key = TypeVar("_Key")


class Milliseconds(Record):
    """Several times for the same picture."""

    median: NonNegative
    """Median."""
    low: NonNegative
    """First quartile."""
    high: NonNegative
    """Third quartile."""
    pictures: Count
    """Number of draws."""

    @classmethod
    def of(cls, spread: Spread) -> "Milliseconds":
        """Return a spread of times as a record."""
        return cls(median=spread.median, low=spread.low, high=spread.high, pictures=spread.count)


def in_turns(draws: Mapping[_Key, Callable[[], float]], turns: int = LEAST_DRAWS) -> dict[_Key, Milliseconds]:
    """Time each of `draws`, which return milliseconds, once a turn; every other turn runs backwards."""
    times: dict[_Key, list[float]] = {key: [] for key in draws}
    for turn in range(turns):
        for key in [*draws][:: -1 if turn % 2 else 1]:
            times[key].append(draws[key]())
    return {key: Milliseconds.of(Spread.of(time)) for key, time in times.items()}
