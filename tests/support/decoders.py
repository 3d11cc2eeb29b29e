"""Functions that stand for decoders of foreign code, sound and bad ones, called in worker processes."""

import ctypes
import mmap
import os
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError


def squares(count: int) -> NDArray[np.generic]:
    """A sound one that takes longer for smaller numbers."""
    time.sleep(max(0.0, 0.02 - count / 1000))
    return np.arange(count, dtype=np.int32).reshape(1, -1) ** 2


def process_id(_argument: object) -> NDArray[np.generic]:
    """In which process it runs."""
    return np.array([os.getpid()])


def refuse(z: int) -> NDArray[np.generic]:
    """One that finds its data damaged."""
    raise VolprepError("VP1090", count=3, z=z)


def crash(_argument: object) -> NDArray[np.generic]:
    """Read from address 0."""
    ctypes.string_at(0)
    return np.zeros(1)


def leave(status: int) -> NDArray[np.generic]:
    """End the process, as libjpeg does on errors if nobody forbids it."""
    os._exit(status)


def hang(_argument: object) -> NDArray[np.generic]:
    """Never end."""
    while True:
        pass


def doze(seconds: float) -> NDArray[np.generic]:
    """Take long, but no processor time."""
    time.sleep(seconds)
    return np.array([seconds])


def work(seconds: float) -> NDArray[np.generic]:
    """Take processor time."""
    until = time.process_time() + seconds
    while time.process_time() < until:
        pass
    return np.array([seconds])


def devour(size_bytes: int) -> NDArray[np.generic]:
    """Take and use memory."""
    return np.ones(size_bytes, dtype=np.uint8)[:1]


def too_large(count: int) -> NDArray[np.generic]:
    """Give more than was asked for."""
    return np.zeros(count, dtype=np.uint8)


def chatter(_argument: object) -> NDArray[np.generic]:
    """Print, from below Python."""
    os.write(1, b"noise\n")
    os.write(2, b"noise\n")
    return np.zeros((2, 3), dtype=">u2")


def transposed(_argument: object) -> NDArray[np.generic]:
    """Give an array that is not in C order."""
    return np.arange(6, dtype=np.float32).reshape(2, 3).T


def sleep_and_mark(path: str) -> NDArray[np.generic]:
    """Tell that it began, and take seconds."""
    with open(path, "a", encoding="ascii") as file:  # noqa: PTH123 - a child of as few imports as can be
        file.write(f"{os.getpid()}\n")
    time.sleep(3)
    return np.zeros(1)


def room_for_a_picture(path: str) -> NDArray[np.generic]:
    """Return the megabytes of address space that reading a picture adds to those of the imported library."""
    import OpenImageIO  # noqa: F401 - not counted

    from volprep_formats.readers.pictures.file import opened

    before = _address_space_mb()
    assert opened(Path(path)).read_image() is not None
    return np.array([_address_space_mb() - before])


def _address_space_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[0]) * mmap.PAGESIZE / 1e6


def leave_a_mark(path: str) -> NDArray[np.generic]:
    """Write a file, by which one sees that it ran."""
    Path(path).write_text("ran")
    return np.zeros(1)
