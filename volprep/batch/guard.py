"""Limits of time and memory for the work of this process: exceeding one ends it at once, and affects no other."""

import faulthandler
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

_LOOK_S = 0.02
_GRACE_S = 10.0
"""Extra time after which a process that does not check its limits is ended."""


@dataclass(frozen=True)
class Limits:
    """Limits for one scan."""

    seconds: float
    """Time of an attempt."""
    memory_bytes: int | None
    """Memory of its process, without mapped files; none for no limit."""


class Peak:
    """The largest memory that has been seen."""

    def __init__(self) -> None:
        self.bytes = 0

    def look(self) -> int:
        """Return the memory of this process in bytes, without memory that it shares with files and other processes."""
        found = psutil.Process().memory_info()
        now: int = found.rss - getattr(found, "shared", 0)
        self.bytes = max(self.bytes, now)
        return now


@contextmanager
def guarded(limits: Limits, note: Callable[[str], None]) -> Iterator[Peak]:
    """Watch this process while the block runs. If it exceeds a limit, `note` gets the limit, and the process ends."""
    peak = Peak()
    done = threading.Event()
    watcher = threading.Thread(target=_watch, args=(limits, note, peak, done), daemon=True)
    with Path(os.devnull).open("w") as nowhere:
        # It needs no lock of Python's, so it also ends code that never releases that lock.
        faulthandler.dump_traceback_later(limits.seconds + _GRACE_S, exit=True, file=nowhere)
        watcher.start()
        try:
            yield peak
        finally:
            done.set()
            watcher.join()
            faulthandler.cancel_dump_traceback_later()


def _watch(limits: Limits, note: Callable[[str], None], peak: Peak, done: threading.Event) -> None:
    deadline = time.monotonic() + limits.seconds
    while time.monotonic() < deadline:
        now = peak.look()
        if limits.memory_bytes is not None and now > limits.memory_bytes:
            _end(note, "memory")
        if done.wait(_LOOK_S):
            return
    _end(note, "time")


def _end(note: Callable[[str], None], why: str) -> None:
    note(why)
    os._exit(1)


def machine_memory_bytes() -> int:
    """Return nine tenths of the memory of this machine, or of the limit of its control group."""
    from distributed.system import MEMORY_LIMIT  # noqa: PLC0415 - loads much, and workers have it

    return int(0.9 * MEMORY_LIMIT)
