"""ledger.jsonl: the final record of each job, one in a line. The last one of a job counts.

Each record is appended by the process that did the work, whole, on the disk, and under a lock. A line that a killed
process left without its end is no record, and the next one that appends removes it.
"""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from pydantic import ValidationError

from volprep.batch.ledger_lines import known_lines
from volprep.batch.place import Place
from volprep.batch.records import JobRecord
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors, write_file
from volprep_formats.record import problems


@dataclass(frozen=True)
class Ledger:
    """The ledger of a batch."""

    place: Place

    def records(self) -> dict[tuple[str, str], JobRecord]:
        """Return the last record of each job, by name and profile. Raises VP8010 for a line that is no record."""
        found: dict[tuple[str, str], JobRecord] = {}
        for number, line in enumerate(self._content().split(b"\n")[:-1], 1):
            record = self._record(line, number)
            found[record.key] = record
        return found

    def last(self, name: str, profile: str) -> JobRecord | None:
        """Return the last record of one job, without parsing the others. Raises VP8010 if it is no record."""
        with output_errors(self.place.ledger):
            try:
                found = known_lines(self.place.ledger).find(_beginning(name, profile))
            except FileNotFoundError:
                return None
        if found is None:
            return None
        begin, line = found
        try:
            return JobRecord.model_validate_json(line)
        except ValidationError as error:
            raise self._no_record(error, self._content().count(b"\n", 0, begin) + 1) from error

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

    def tidy(self) -> dict[tuple[str, str], JobRecord]:
        """Leave only the last record of each job, in the order of their names, and return them."""
        with self._locked():
            records = self.records()
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

    def _record(self, line: bytes, number: int) -> JobRecord:
        try:
            return JobRecord.model_validate_json(line)
        except ValidationError as error:
            raise self._no_record(error, number) from error

    def _no_record(self, error: ValidationError, number: int) -> VolprepError:
        return VolprepError("VP8010", path=self.place.ledger, line=number, problem=problems(error))


def _line(record: JobRecord) -> bytes:
    rest = record.model_dump(mode="json", exclude={"name", "profile"})
    # In ASCII: no letter in it can be taken for the end of a line.
    return _beginning(record.name, record.profile) + json.dumps(rest, sort_keys=True).encode()[1:] + b"\n"


def _beginning(name: str, profile: str) -> bytes:
    """Return how the line of a job begins: what `beginning_of` gives of it."""
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
