"""Zips that two programs read as two packages: each breaks one rule of spec/README.md."""

import struct
from collections.abc import Callable, Sequence
from typing import NamedTuple
from zlib import crc32

_END = struct.Struct("<4s4H2IH")


class Entry(NamedTuple):
    """One file of a zip, with everything that its headers say."""

    name: bytes
    data: bytes
    flags: int = 0
    method: int = 0
    local_name: bytes | None = None
    local_extra: bytes = b""
    extra: bytes = b""
    comment: bytes = b""
    local_crc: int | None = None
    local_size: int | None = None
    gap: bytes = b""
    """Bytes between this file and the next header."""


def zip_of(
    entries: Sequence[Entry],
    *,
    before: bytes = b"",
    comment: bytes = b"",
    behind: bytes = b"",
    count: int | None = None,
) -> bytes:
    """Write a zip by hand, right unless told otherwise; `behind` follows the entries of the directory."""
    body, heads = bytearray(before), []
    for entry in entries:
        heads.append(len(body))
        name = entry.name if entry.local_name is None else entry.local_name
        crc = crc32(entry.data) if entry.local_crc is None else entry.local_crc
        size = len(entry.data) if entry.local_size is None else entry.local_size
        head = (20, entry.flags, entry.method, 0, 33, crc, size, size, len(name), len(entry.local_extra))
        body += struct.pack("<4s5H3I2H", b"PK\3\4", *head) + name + entry.local_extra + entry.data + entry.gap
    start = len(body)
    for entry, at in zip(entries, heads, strict=True):
        sizes = (crc32(entry.data), len(entry.data), len(entry.data))
        lengths = (len(entry.name), len(entry.extra), len(entry.comment))
        head = (20, 20, entry.flags, entry.method, 0, 33, *sizes, *lengths, 0, 0, 0, at)
        body += struct.pack("<4s6H3I5H2I", b"PK\1\2", *head) + entry.name + entry.extra + entry.comment
    body += behind
    number = len(entries) if count is None else count
    end = _END.pack(b"PK\5\6", 0, 0, number, number, len(body) - start, start, len(comment))
    return bytes(body) + end + comment


def _first(entries: Sequence[Entry], **changes: object) -> list[Entry]:
    return [entries[0]._replace(**changes), *entries[1:]]


def _last(entries: Sequence[Entry], **changes: object) -> list[Entry]:
    return [*entries[:-1], entries[-1]._replace(**changes)]


def _two_ends(entries: Sequence[Entry]) -> bytes:
    """The end record that a search from the back finds first is not the one whose comment reaches the end."""
    return zip_of(entries, comment=zip_of([Entry(b"manifest.json", b"{}")]))


def _zip64(entries: Sequence[Entry], **wrong: int) -> bytes:
    """A ZIP64 end record that says the same as the end record, unless told otherwise."""
    data = zip_of(entries)
    *_, number, size, start, _ = _END.unpack(data[-22:])
    said = {"number": number, "size": size, "start": start, "at": len(data) - 22, "parts": 1} | wrong
    wide = struct.pack(
        "<4sQ2H2I4Q", b"PK\6\6", 44, 45, 45, 0, 0, said["number"], said["number"], said["size"], said["start"]
    )
    return data[:-22] + wide + struct.pack("<4sIQI", b"PK\6\7", 0, said["at"], said["parts"]) + data[-22:]


Trick = Callable[[Sequence[Entry]], bytes]
TRICKS: dict[str, Trick] = {
    "a comment": lambda entries: zip_of(entries, comment=b"hidden"),
    "another zip as the comment": _two_ends,
    "text before it": lambda entries: b"#!/bin/sh\n" + zip_of(entries),
    "text before it that the places count": lambda entries: zip_of(entries, before=b"#!/bin/sh\n"),
    "bytes behind it": lambda entries: zip_of(entries) + b"\0",
    "bytes behind the directory": lambda entries: zip_of(entries, behind=b"hidden"),
    "a file that the directory does not name": lambda entries: zip_of(
        _first(entries, gap=zip_of([Entry(b"manifest.json", b"{}")])[:43])
    ),
    "a gap before the directory": lambda entries: zip_of(_last(entries, gap=b"hidden")),
    "more entries than there are": lambda entries: zip_of(entries, count=len(entries) + 1),
    "fewer entries than there are": lambda entries: zip_of(entries, count=len(entries) - 1),
    "a comment of an entry": lambda entries: zip_of(_first(entries, comment=b"hidden")),
    "a name twice": lambda entries: zip_of([*entries, entries[0]]),
    "another name before the bytes": lambda entries: zip_of(_first(entries, local_name=b"manifest.jsom")),
    "a name that is not ASCII": lambda entries: zip_of([*entries, Entry("ü".encode(), b"")]),
    "compressed": lambda entries: zip_of(_first(entries, method=8)),
    "encrypted": lambda entries: zip_of(_first(entries, flags=1)),
    "sizes behind the bytes": lambda entries: zip_of(_first(entries, flags=8)),
    "an unknown flag": lambda entries: zip_of(_first(entries, flags=4)),
    "another CRC before the bytes": lambda entries: zip_of(_first(entries, local_crc=7)),
    "another size before the bytes": lambda entries: zip_of(_first(entries, local_size=7)),
    "damaged extra fields": lambda entries: zip_of(_first(entries, extra=b"\1\0\x09\0")),
    "damaged extra fields before the bytes": lambda entries: zip_of(_first(entries, local_extra=b"abc")),
    "the ZIP64 field twice": lambda entries: zip_of(_first(entries, extra=b"\1\0\0\0" * 2)),
    "a ZIP64 end record of another place": lambda entries: _zip64(entries, start=1),
    "a ZIP64 end record of another number": lambda entries: _zip64(entries, number=1),
    "a ZIP64 locator that points elsewhere": lambda entries: _zip64(entries, at=0),
    "a ZIP64 locator of two parts": lambda entries: _zip64(entries, parts=2),
    "nothing": lambda entries: b"",
    "an end record alone": lambda entries: zip_of([]),
}
"""Zips that break one rule, by what is wrong with them; made of the files of a sound package."""
SOUND: dict[str, Trick] = {
    "plain": zip_of,
    "names said to be UTF-8": lambda entries: zip_of([each._replace(flags=0x800) for each in entries]),
    "extra fields": lambda entries: zip_of(
        [each._replace(extra=b"UT\1\0x", local_extra=b"UT\2\0xy") for each in entries]
    ),
    "a ZIP64 end record": _zip64,
    "another order": lambda entries: zip_of(entries[::-1]),
}
"""Zips that break no rule, by what is unusual about them."""
