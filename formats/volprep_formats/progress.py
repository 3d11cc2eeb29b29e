"""Progress reports of long work, independent of their display."""

from typing import Protocol


class Progress(Protocol):
    """Receives reports of work done. Progress bars and logs implement this."""

    def start(self, task: str, total: int) -> None:
        """Begin `task`, which has `total` units of work (0 if not known)."""

    def advance(self, units: int = 1) -> None:
        """Count `units` of the current task as done."""


class Silent:
    """Progress without a display."""

    def start(self, task: str, total: int) -> None:
        """Ignore the start of a task."""

    def advance(self, units: int = 1) -> None:
        """Ignore work done."""
