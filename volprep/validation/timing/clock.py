"""Time spent in each part of a validation."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock


class Clock:
    """Adds up wall time by part. Parts may run at one time, in threads; time of the same part counts once."""

    def __init__(self) -> None:
        """Start at nothing."""
        self._seconds: dict[str, float] = {}
        self._running: dict[str, list[float]] = {}
        """When each running part of a name began."""
        self._changes = Lock()

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count the time of the block for the part `name`."""
        with self._changes:
            self._running.setdefault(name, []).append(time.perf_counter())
        try:
            yield
        finally:
            with self._changes:
                so_far = self._so_far(name)
                # The first one tells how long the part has run.
                self._running[name].pop()
                if not self._running[name]:
                    self._seconds[name] = so_far

    def so_far(self) -> dict[str, float]:
        """Return the seconds of each part, in order of name, including the elapsed time of running parts."""
        return {name: self._so_far(name) for name in sorted(self._running)}

    def _so_far(self, name: str) -> float:
        running = self._running[name]
        return self._seconds.get(name, 0.0) + (time.perf_counter() - running[0] if running else 0.0)
