"""Frames of a time series in one file: how many there are, and when each was taken."""

from dataclasses import dataclass
from pathlib import Path

from volprep_formats.diagnostics import VolprepError


@dataclass(frozen=True)
class TimeAxis:
    """The axis of a file along which time runs."""

    count: int
    """Number of frames."""
    times_s: tuple[float, ...] | None = None
    """Time of each frame in seconds; None if the file does not say."""

    @classmethod
    def even(cls, count: int, step_s: float, start_s: float = 0.0) -> "TimeAxis":
        """Return frames at equal distances in time."""
        return cls(count, tuple(start_s + number * step_s for number in range(count)))


def not_time(path: Path, what: str) -> VolprepError:
    """Return VP1340: the file says that its volumes are not frames of a time series."""
    return VolprepError("VP1340", path=path, what=what)
