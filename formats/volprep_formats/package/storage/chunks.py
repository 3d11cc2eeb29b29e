"""A file written in chunks: digest, copy to the system's memory and work of the disk go on at the same time."""

import hashlib
import os
from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from io import FileIO

_AHEAD = 2
"""Chunks that may wait for digest or disk while the next is made."""
_DISK_BYTES = 16 * 1024 * 1024
"""Bytes after which writing to the disk begins. Writing 81 MB at the end takes as long as the digest."""


def write_chunks(file: FileIO, chunks: Iterable[bytes | memoryview]) -> tuple[int, str]:
    """Write chunks one after another; return the number of bytes and their SHA-256.

    A chunk must not change after it was passed. The data is durable when the file has been synced once more. Raises
    OSError, and the errors of `chunks`.
    """
    digest = hashlib.sha256()
    size = waits = 0
    pending: deque[Future[None]] = deque()
    synced: Future[None] | None = None
    with ThreadPoolExecutor(1) as hashing, ThreadPoolExecutor(1) as writing, ThreadPoolExecutor(1) as syncing:
        for chunk in chunks:
            pending += (hashing.submit(digest.update, chunk), writing.submit(write_all, file, chunk))
            while len(pending) > 2 * _AHEAD:
                pending.popleft().result()
            octets = memoryview(chunk).nbytes
            size += octets
            waits += octets
            if waits >= _DISK_BYTES and (synced is None or synced.done()):
                if synced is not None:
                    synced.result()  # the system tells an error of the disk once only
                synced, waits = syncing.submit(os.fsync, file.fileno()), 0
        for future in pending:
            future.result()
    if synced is not None:
        synced.result()
    return size, digest.hexdigest()


def write_all(file: FileIO, data: bytes | memoryview) -> None:
    """Write all of `data`; the system may take less at once. Raises OSError."""
    rest = memoryview(data).cast("B")
    while len(rest):
        rest = rest[file.write(rest) :]
