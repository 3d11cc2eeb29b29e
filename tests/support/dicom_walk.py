"""The walk over a plain DICOM header, slow and obvious: the whole file in memory, one element after the other."""

import struct
from pathlib import Path

SHORT = b"AE AS AT CS DA DS DT FL FD IS LO LT PN SH SL SS ST TM UI UL US".split()
LONG = b"OB OD OF OL OV OW SQ SV UC UN UR UT UV".split()
UNDEFINED = 0xFFFFFFFF
IMPLICIT = b"1.2.840.10008.1.2"
MOST_BYTES = 2**25
MOST_WANTED_BYTES = 2**20
DEEPEST = 8


class UnusualError(Exception):
    """The file is not plain."""


def walked(path: Path, wanted) -> tuple | None:
    """What volprep_formats._dicom.plain_headers gives for one file."""
    data = path.read_bytes()
    try:
        syntax, at = meta(data)
        explicit = syntax != IMPLICIT
        elements, at = data_set(data, at, frozenset(wanted), explicit=explicit)
    except UnusualError:
        return None
    return syntax, elements, data[at : at + (12 if explicit else 8)], at, len(data)


def part(data: bytes, start: int, stop: int) -> bytes:
    if stop > min(len(data), MOST_BYTES):
        raise UnusualError
    return data[start:stop]


def element(data: bytes, at: int, *, explicit: bool) -> tuple[int, bytes, int, int]:
    """Tag, type, start and length of a value."""
    twelve = part(data, at, at + 12)
    group, number = struct.unpack("<HH", twelve[:4])
    tag = group << 16 | number
    if not explicit:
        return tag, b"", at + 8, struct.unpack("<L", twelve[4:8])[0]
    kind = twelve[4:6]
    if kind in SHORT:
        return tag, kind, at + 8, struct.unpack("<H", twelve[6:8])[0]
    if kind in LONG:
        return tag, kind, at + 12, struct.unpack("<L", twelve[8:])[0]
    raise UnusualError


def meta(data: bytes) -> tuple[bytes, int]:
    if part(data, 0, 144)[128:140] != b"DICM\x02\0\0\0UL\x04\0":
        raise UnusualError
    at = 144
    end = at + struct.unpack("<L", data[140:144])[0]
    syntax, last = b"", 0x00020000
    while at < end:
        tag, _, start, length = element(data, at, explicit=True)
        if not last < tag < 0x00030000 or length == UNDEFINED:
            raise UnusualError
        last, at = tag, start + length
        if tag == 0x00020010:
            syntax = part(data, start, at).rstrip(b"\0 ")
    if at != end:
        raise UnusualError
    return syntax, at


def data_set(data: bytes, at: int, wanted: frozenset[int], *, explicit: bool) -> tuple[dict[int, bytes], int]:
    """The wanted elements, and where that begins which holds the pixels."""
    if not explicit and part(data, at + 4, at + 6) in SHORT + LONG:
        raise UnusualError
    found, last = {}, 0x0007FFFF
    while True:
        tag, kind, start, length = element(data, at, explicit=explicit)
        if tag <= last or tag == 0x52009230:
            raise UnusualError
        last = tag
        if tag in {0x7FE00008, 0x7FE00009, 0x7FE00010}:
            if explicit and kind not in {b"OB", b"OW", b"OF", b"OD"}:
                raise UnusualError
            return found, at
        if length == UNDEFINED:
            if kind != b"SQ":
                raise UnusualError
            at = after_sequence(data, start, 1)
        else:
            at = start + length
            if tag in wanted:
                found[tag] = part(data, start, at)
                if sum(map(len, found.values())) > MOST_WANTED_BYTES:
                    raise UnusualError


def after_sequence(data: bytes, at: int, depth: int) -> int:
    if depth > DEEPEST:
        raise UnusualError
    while True:
        tag, _, at, length = element(data, at, explicit=False)
        if (tag, length) == (0xFFFEE0DD, 0):
            return at
        if tag != 0xFFFEE000:
            raise UnusualError
        at = after_item(data, at, None if length == UNDEFINED else at + length, depth)


def after_item(data: bytes, at: int, end: int | None, depth: int) -> int:
    while at != end:
        tag, _, start, length = element(data, at, explicit=False)
        if end is None and (tag, length) == (0xFFFEE00D, 0):
            return start
        _, kind, start, length = element(data, at, explicit=True)
        if length != UNDEFINED:
            at = start + length
        elif kind == b"SQ":
            at = after_sequence(data, start, depth + 1)
        else:
            raise UnusualError
        if end is not None and at > end:
            raise UnusualError
    return at
