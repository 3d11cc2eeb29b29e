"""Open untrusted paths: regular files only, with a bound on the bytes read.

Reading a pipe or a device such as /dev/zero would never end. Links are followed; their target must be a regular file.
"""

import errno
import gzip
import os
import stat
import zlib
from contextlib import suppress
from io import BufferedReader, FileIO
from pathlib import Path

MOST_TEXT_BYTES = 2**20
"""Largest text file that a user writes: a scene, a profile, a transfer function. They have some kilobytes."""

_KINDS = {stat.S_IFIFO: "a named pipe", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device", stat.S_IFSOCK: "a socket"}


def is_there(path: Path) -> bool:
    """Return whether there is a file of a name that a header or a rule has made, which may be too long to exist."""
    with suppress(OSError):
        return path.is_file()
    return False


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file for reading. Raises OSError, also for other kinds of files, with the reason in `strerror`."""
    return BufferedReader(open_unbuffered(path))


def open_unbuffered(path: Path) -> FileIO:
    """Open a regular file as `open_regular` does, without a buffer."""
    # O_NONBLOCK: opening a pipe without a writer would block for ever. It has no effect on regular files.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        _check_kind(path, os.fstat(descriptor))
    except OSError:
        os.close(descriptor)
        raise
    return FileIO(descriptor, "rb")


def open_gzipped(path: Path) -> gzip.GzipFile:
    """Open a regular gzipped file and read its unpacked contents. Raises OSError."""
    file = open_unbuffered(path)
    unpacked = gzip.GzipFile(fileobj=file)
    unpacked.myfileobj = file  # closes it, too
    return unpacked


def is_gzip(path: Path) -> bool:
    """Whether the file begins as gzip does."""
    with open_regular(path) as file:
        return file.read(2) == b"\x1f\x8b"


def open_unpacked(path: Path) -> gzip.GzipFile | BufferedReader:
    """Open a regular file and read its contents, unpacked if it is gzipped. Raises OSError."""
    return open_gzipped(path) if is_gzip(path) else open_regular(path)


def unpacked_head(path: Path, count: int) -> tuple[bytes, bool]:
    """Return the first bytes of a regular file, unpacked if it is gzipped and sound, and whether it is gzipped.

    Raises OSError.
    """
    with open_regular(path) as file:
        head = file.read(count)
    is_gzip = head[:2] == b"\x1f\x8b"
    if is_gzip:
        with suppress(EOFError, zlib.error, gzip.BadGzipFile), open_gzipped(path) as unpacked:
            return unpacked.read(count), True
    return head, is_gzip


def check_regular_or_folder(path: Path) -> None:
    """Raise OSError for a path that is neither a regular file nor a folder, or cannot be reached."""
    state = path.stat()
    if not stat.S_ISDIR(state.st_mode):
        _check_kind(path, state)


def read_regular(path: Path, most_bytes: int = MOST_TEXT_BYTES) -> bytes:
    """Return all bytes of a regular file. Raises OSError, also for a file of more than `most_bytes`."""
    with open_regular(path) as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise OSError(errno.EINVAL, f"it has more than {most_bytes} bytes", str(path))
    return data


def _check_kind(path: Path, state: os.stat_result) -> None:
    if stat.S_ISDIR(state.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(state.st_mode):
        kind = _KINDS.get(stat.S_IFMT(state.st_mode), "no file")
        raise OSError(errno.EINVAL, f"it is {kind}, not a regular file", str(path))
