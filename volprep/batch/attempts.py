"""The lock file of a job, which also lists the attempts of its builds, so that the next attempt knows of a crash.

The system releases the lock when its process ends, however it ends. The file then shows how far the attempt came.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

End = Literal["killed", "time", "memory"]
"""End of an attempt that left no record."""
_BEGUN = "begun"


@dataclass(frozen=True)
class Attempts:
    """Attempts of one batch at one job, by the process that holds the job's lock."""

    descriptor: int
    """Descriptor of the locked file; its lines have the batch's number and an event."""
    path: Path
    run: str
    """Number of the batch: attempts of another batch say nothing about this scan."""

    def begin(self) -> None:
        """Note that an attempt begins."""
        self.note(_BEGUN)

    def note(self, what: str) -> None:
        """Write an event; it is kept even if this process ends at once."""
        os.write(self.descriptor, f"{self.run} {what}\n".encode())

    def deaths(self) -> list[End]:
        """Return how each attempt of this batch ended: all died, since the job has no record."""
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


def forget_done(path: Path) -> None:
    """Remove the lock file of a job that has its record: a process that was killed in between left it.

    Raises OSError.
    """
    if path.exists():
        with job_locked(path, "") as attempts:
            if attempts is not None:
                attempts.forget()


def _locked(path: Path) -> int | None:
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            return None
        # The previous owner of the lock may have removed the file between our opening and our locking it.
        if path.exists() and os.path.samestat(os.fstat(descriptor), path.stat()):
            return descriptor
        os.close(descriptor)
