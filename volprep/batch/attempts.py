"""The lock of a job, and in the same file the attempts of its builds, so that a death is known to the next attempt.

The system lets go of the lock when its process ends, however it ends. What the file says then is how far it came.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

End = Literal["killed", "time", "memory"]
"""How an attempt ended that left no record."""
_BEGUN = "begun"


@dataclass(frozen=True)
class Attempts:
    """Attempts of one batch at one job, by the process that holds the job's lock."""

    descriptor: int
    """Of the locked file; lines of the batch's number and what happened."""
    path: Path
    run: str
    """Number of the batch: what another one began says nothing of this scan."""

    def begin(self) -> None:
        """Note that an attempt begins."""
        self.note(_BEGUN)

    def note(self, what: str) -> None:
        """Note what happens; it is there also if this process ends at once."""
        os.write(self.descriptor, f"{self.run} {what}\n".encode())

    def deaths(self) -> list[End]:
        """Return how each attempt of this batch ended: none of them left a record, or nobody would ask."""
        size = os.fstat(self.descriptor).st_size
        found: list[End] = []
        for line in os.pread(self.descriptor, size, 0).decode().splitlines():
            run, _, what = line.partition(" ")
            if run != self.run:
                continue
            if what == _BEGUN:
                found.append("killed")
            elif found and what in {"time", "memory"}:
                found[-1] = "time" if what == "time" else "memory"
        return found

    def forget(self) -> None:
        """Remove the file: the job has its record."""
        self.path.unlink(missing_ok=True)


@contextmanager
def job_locked(path: Path, run: str) -> Iterator[Attempts | None]:
    """Hold the lock of a job; None if another process holds it. Raises OSError."""
    descriptor = _locked(path)
    if descriptor is None:
        yield None
        return
    try:
        yield Attempts(descriptor, path, run)
    finally:
        os.close(descriptor)


def _locked(path: Path) -> int | None:
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            return None
        # Who had the lock may have removed the file between our opening and our locking it.
        if path.exists() and os.path.samestat(os.fstat(descriptor), path.stat()):
            return descriptor
        os.close(descriptor)
