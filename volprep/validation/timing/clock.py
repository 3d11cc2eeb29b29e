"""Time spent in each part of a validation."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Clock:
    """Adds up wall time by part. Parts of different names may run at one time, in threads."""

    def __init__(self) -> None:
        """Start at nothing."""
        self._seconds: dict[str, float] = {}
        self._running: dict[str, float] = {}

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count the time of the block for the part `name`."""
        self._running[name] = time.perf_counter()
        try:
            yield
        finally:
            self._seconds[name] = self._so_far(name)
            del self._running[name]

    def so_far(self) -> dict[str, float]:
        """Return the seconds of each part, in order of name, including the elapsed time of running parts."""
        return {name: self._so_far(name) for name in sorted(self._seconds.keys() | self._running.keys())}

    def _so_far(self, name: str) -> float:
        running = time.perf_counter() - self._running[name] if name in self._running else 0.0
        return self._seconds.get(name, 0.0) + running
