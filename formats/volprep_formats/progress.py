"""How long work tells how far it is, without knowing who listens."""

from typing import Protocol


class Progress(Protocol):
    """Takes reports of work done. Whoever draws them, or logs them, implements this."""

    def start(self, task: str, total: int) -> None:
        """Begin `task`, which has `total` units of work (0 if not known)."""
        ...

    def advance(self, units: int = 1) -> None:
        """Count `units` of the current task as done."""
        ...


class Silent:
    """Progress that nobody watches."""

    def start(self, task: str, total: int) -> None:
        """Ignore the start of a task."""

    def advance(self, units: int = 1) -> None:
        """Ignore work done."""
