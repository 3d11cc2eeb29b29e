"""Frames of a time series in one file: how many there are, and when each was taken."""

from dataclasses import dataclass
from math import inf
from pathlib import Path

from volprep_formats.diagnostics import VolprepError

_SECONDS_PER_UNIT = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "usec", "\u00b5s", "\u03bcs", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
}
"""Units of time that files name, in lower case."""


def seconds_per(unit: str) -> float | None:
    """Return the length of a unit of time in seconds; None for any other word."""
    return _SECONDS_PER_UNIT.get(unit.strip().lower())


@dataclass(frozen=True)
class TimeAxis:
    """The axis of a file along which time runs."""

    count: int
    """Number of frames."""
    times_s: tuple[float, ...] | None = None
    """Time of each frame in seconds; None if the file does not say."""

    @classmethod
    def even(cls, count: int, step: float, seconds: float | None, start: float = 0.0) -> "TimeAxis":
        """Return frames at equal distances in time; `seconds` is the length of the unit, None if it is not known."""
        if seconds is None or not 0.0 < step < inf or not -inf < start < inf:
            return cls(count)
        step_s, start_s = step * seconds, start * seconds
        return cls(count, tuple(start_s + number * step_s for number in range(count)))


def not_time(path: Path, what: str) -> VolprepError:
    """Return VP1340: the file says that its volumes are not frames of a time series."""
    return VolprepError("VP1340", path=path, what=what)
