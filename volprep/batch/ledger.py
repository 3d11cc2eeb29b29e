"""The file ledger.jsonl: the final record of each job, one per line. The last record of a job counts.

Each record is appended, whole and under a lock, and flushed to disk by the process that did the work. A line that a
killed process left incomplete is no record, and the next append removes it.
"""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Lock
from typing import BinaryIO

from pydantic import ValidationError

from volprep.batch.place import Place
from volprep.batch.records import JobRecord
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors, write_file
from volprep_formats.record import problems


class LedgerLines:
    """Index of the last line of each job, in this process: only new lines are read. Threads may share it."""

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


@dataclass(frozen=True)
class Ledger:
    """The ledger of a batch."""

    place: Place

    def records(self, passed: list[VolprepError] | None = None) -> dict[tuple[str, str], JobRecord]:
        """Return the last record of each job, by name and profile.

        A line that is not a record is left out, and its VP8010 is added to `passed`: its scan is built again.
        """
        found: dict[tuple[str, str], JobRecord] = {}
        for number, line in enumerate(self._content().split(b"\n")[:-1], 1):
            try:
                record = JobRecord.model_validate_json(line)
            except ValidationError as error:
                if passed is not None:
                    passed.append(VolprepError("VP8010", path=self.place.ledger, line=number, problem=problems(error)))
                continue
            found[record.key] = record
        return found

    def last(self, name: str, profile: str) -> JobRecord | None:
        """Return the last record of one job, without parsing the others; None if there is no readable one."""
        with output_errors(self.place.ledger):
            try:
                found = known_lines(self.place.ledger).find(_beginning(name, profile))
            except FileNotFoundError:
                return None
        if found is None:
            return None
        try:
            return JobRecord.model_validate_json(found[1])
        except ValidationError:
            return None

    def append(self, record: JobRecord) -> None:
        """Add a record, which is on the disk when this returns. Raises VP4020, and then nothing has been added."""
        line = _line(record)
        with self._locked():
            descriptor = os.open(self.place.ledger, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                end = _end_of_whole_lines(descriptor)
                os.ftruncate(descriptor, end)
                written = os.pwrite(descriptor, line, end)
                if written < len(line):  # no room for the rest
                    written += os.pwrite(descriptor, line[written:], end + written)
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def tidy(self, passed: list[VolprepError] | None = None) -> dict[tuple[str, str], JobRecord]:
        """Leave only the last record of each job, in the order of their names, and return them as `records` does."""
        with self._locked():
            records = self.records(passed)
            text = b"".join(_line(records[key]) for key in sorted(records))
            if text != self._content():
                write_file(self.place.ledger, text)
            return records

    @contextmanager
    def _locked(self) -> Iterator[None]:
        with output_errors(self.place.ledger):
            descriptor = os.open(self.place.ledger_lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX)
                yield
            finally:
                os.close(descriptor)

    def _content(self) -> bytes:
        with output_errors(self.place.ledger):
            try:
                return self.place.ledger.read_bytes()
            except FileNotFoundError:
                return b""


def _line(record: JobRecord) -> bytes:
    rest = record.model_dump(mode="json", exclude={"name", "profile"})
    # In ASCII: no letter in it can be taken for the end of a line.
    return _beginning(record.name, record.profile) + json.dumps(rest, sort_keys=True).encode()[1:] + b"\n"


def _beginning(name: str, profile: str) -> bytes:
    """Return the beginning of the line of a job, as `beginning_of` returns it."""
    return f'{{"name": {json.dumps(name)}, "profile": {json.dumps(profile)}, '.encode()


def _end_of_whole_lines(descriptor: int) -> int:
    """Return the place after the last line that is whole, read from the end."""
    end = os.fstat(descriptor).st_size
    while end:
        start = max(0, end - 4096)
        at = os.pread(descriptor, end - start, start).rfind(b"\n")
        if at >= 0:
            return start + at + 1
        end = start
    return 0
