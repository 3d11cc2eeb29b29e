"""Index of the last line of each job in a ledger: each process reads only lines that are new to it.

Lines are only added to a ledger, except that tidying replaces the file when its last line is torn.
"""

import os
from functools import cache
from pathlib import Path
from threading import Lock
from typing import BinaryIO


class LedgerLines:
    """Index of one ledger in this process. Threads may share it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lock = Lock()
        self._forget()

    def find(self, beginning: bytes) -> tuple[int, bytes] | None:
        """Return place and bytes of the last whole line with this beginning, or None.

        `beginning` is the result of `beginning_of` for the line. Raises OSErrors, also if there is no file.
        """
        with self._lock, self._path.open("rb") as file:
            for _ in range(2):
                self._read_on(file)
                begin = self._begins.get(beginning)
                if begin is None:
                    return None
                file.seek(begin)
                line = file.readline()
                if line.startswith(beginning):
                    return begin, line
                self._forget()
        return None

    def _forget(self) -> None:
        self._file = -1
        self._end = 0
        self._last = b""
        self._begins: dict[bytes, int] = {}

    def _read_on(self, file: BinaryIO) -> None:
        if not self._goes_on(file):
            self._forget()
            self._file = os.fstat(file.fileno()).st_ino
        file.seek(self._end)
        for line in file:
            if line.endswith(b"\n"):
                self._begins[beginning_of(line)] = self._end
                self._end += len(line)
                self._last = line

    def _goes_on(self, file: BinaryIO) -> bool:
        """Whether a file still has the content that was read. The inode number of a deleted file may be reused."""
        file.seek(self._end - len(self._last))
        return os.fstat(file.fileno()).st_ino == self._file and file.read(len(self._last)) == self._last


@cache
def known_lines(path: Path) -> LedgerLines:
    """Return this process's index of a ledger."""
    return LedgerLines(path)


def beginning_of(line: bytes) -> bytes:
    """Return a line up to the comma after name and profile. Both are JSON, in which quotes are escaped."""
    after_name = line.find(b'", "profile": "')
    return line[: line.find(b'", ', after_name + 1) + len(b'", ')]
