"""The part of a file that a request asks for: one range of bytes (RFC 9110, section 14)."""

import re

_RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})")


class UnsatisfiableError(ValueError):
    """The range lies beyond the file."""


def part_of(header: str | None, size: int) -> tuple[int, int] | None:
    """Return the first byte of a range and the byte after its last; None if the whole file is to be sent.

    Several ranges, other units and malformed ranges are ignored, as the RFC allows. Raises UnsatisfiableError.
    """
    found = _RANGE.fullmatch(header.strip()) if header else None
    if found is None or not (found[1] or found[2]):
        return None
    if not found[1]:
        start, stop = max(0, size - int(found[2])), size
    else:
        start = int(found[1])
        stop = min(int(found[2]) + 1, size) if found[2] else size
        if found[2] and int(found[2]) < start:
            return None
    if start >= stop:
        raise UnsatisfiableError
    return start, stop
