"""The strict parse of the single-file form of a package: spec/README.md.

A zip can be read from its end, from its beginning or by its directory. Readers that differ in this can see two packages
in one file. This parse takes only files in which all three ways find the same bytes.
"""

import struct
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

LARGEST_DIRECTORY_BYTES = 8 << 20
"""Largest directory: about 60 000 files."""
_END = struct.Struct("<4s4H2IH")
_END64 = struct.Struct("<4sQ2H2I4Q")
_LOCATOR = struct.Struct("<4sIQI")
_ENTRY = struct.Struct("<4s6H3I5H2I")
_LOCAL = struct.Struct("<4s5H3I2H")
_LOCATOR_MAGIC = b"PK\x06\x07"
_FIELD = struct.Struct("<2H")
_ZIP64_ID = 1
_IN_ZIP64 = 0xFFFFFFFF
_MANY = 0xFFFF
_UTF8_NAME = 0x0800
"""The only flag that an entry may have: the name is UTF-8."""


class ZipEntry(NamedTuple):
    """One file of the zip, as the directory describes it."""

    name: str
    """Name; ASCII."""
    header_bytes: int
    """Offset of its local header."""
    size_bytes: int
    """Size."""
    crc32: int
    """CRC-32 of its bytes."""
    flags: int
    """Flags."""


class _Directory(NamedTuple):
    start: int
    length: int
    files: int


def read_directory(file: BinaryIO, size_bytes: int) -> dict[str, tuple[ZipEntry, int]]:
    """Return each entry of a zip of this size with the place where its bytes begin, by name.

    Raises ValueError for a zip that breaks a rule of spec/README.md.
    """
    found = _find_directory(file, size_bytes)
    file.seek(found.start)
    entries = [*_entries(file.read(found.length), found.files)]
    names = [entry.name for entry in entries]
    if len(set(names)) < len(names):
        raise ValueError(f"{max(names, key=names.count)!r} is there twice")
    ordered = sorted(entries, key=lambda entry: entry.header_bytes)
    if (ordered[0].header_bytes if ordered else found.start) != 0:
        raise ValueError("its first file does not begin at its first byte")
    following = [*(entry.header_bytes for entry in ordered[1:]), found.start]
    return {
        entry.name: (entry, _start(file, entry, next_bytes))
        for entry, next_bytes in zip(ordered, following, strict=True)
    }


def _find_directory(file: BinaryIO, size_bytes: int) -> _Directory:
    """Find the directory by the end record, which is the last 22 bytes."""
    at = size_bytes - _END.size
    if at < 0:
        raise ValueError("it is too short for a zip")
    before = min(at, _LOCATOR.size)
    file.seek(at - before)
    is_zip64 = file.read(before).startswith(_LOCATOR_MAGIC)
    magic, disk, first_disk, here, count, size, start, comment = _END.unpack(file.read(_END.size))
    if magic != b"PK\x05\x06" or comment:
        raise ValueError("it is not a zip whose end record is its last 22 bytes, without a comment")
    if disk or first_disk or here != count:
        raise ValueError("it is one of several parts of a zip")
    found = _Directory(start, size, count)
    if is_zip64:
        at, found = _find_directory64(file, at, found)
    if found.length > LARGEST_DIRECTORY_BYTES or found.start + found.length != at:
        raise ValueError("its directory does not end where its end record begins, or is too large")
    return found


def _find_directory64(file: BinaryIO, end: int, short: _Directory) -> tuple[int, _Directory]:
    """Return where the ZIP64 end record begins, and the directory that it names."""
    at = end - _LOCATOR.size - _END64.size
    if at < 0:
        raise ValueError("its ZIP64 end record is missing")
    file.seek(at)
    magic, size, _, _, disk, first_disk, here, count, length, start = _END64.unpack(file.read(_END64.size))
    locator = _LOCATOR.unpack(file.read(_LOCATOR.size))
    if magic != b"PK\x06\x06" or size != _END64.size - 12 or locator != (_LOCATOR_MAGIC, 0, at, 1):
        raise ValueError("its ZIP64 end record is missing or out of place")
    agrees = short.files in {count, _MANY} and short.length in {length, _IN_ZIP64} and short.start in {start, _IN_ZIP64}
    if disk or first_disk or here != count or not agrees:
        raise ValueError("its two end records differ")
    return at, _Directory(start, length, count)


def _entries(data: bytes, count: int) -> Iterator[ZipEntry]:
    at = 0
    for number in range(count):
        if len(data) - at < _ENTRY.size:
            raise ValueError("its directory is cut off")
        head = _ENTRY.unpack_from(data, at)
        magic, _, _, flags, method, _, _, crc, packed, size, name, extra, comment, disk, _, _, start = head
        end = at + _ENTRY.size + name + extra + comment
        if magic != b"PK\x01\x02" or end > len(data):
            raise ValueError(f"entry {number} of its directory is damaged")
        text = data[at + _ENTRY.size :][:name].decode("latin-1")
        fields = data[at + _ENTRY.size + name :][:extra]
        packed, size, start = _widened(text, fields, packed=packed, size=size, start=start)
        if method or packed != size or flags & ~_UTF8_NAME:
            raise ValueError(f"{text!r} is compressed, encrypted, or has its sizes behind it")
        if comment or disk or not text.isascii():
            raise ValueError(f"{text!r} has a comment, is in another part, or has a name that is not ASCII")
        yield ZipEntry(text, start, size, crc, flags)
        at = end
    if at != len(data):
        raise ValueError("its directory has bytes behind its entries")


def _widened(name: str, fields: bytes, *, packed: int, size: int, start: int) -> tuple[int, int, int]:
    """Replace numbers that do not fit 32 bits with the values of the ZIP64 field."""
    wide = _zip64(name, fields)
    values = []
    for value in (size, packed, start):
        if value == _IN_ZIP64:
            if len(wide) < 8:
                raise ValueError(f"{name!r} has no ZIP64 field for a size or a place")
            value, wide = int.from_bytes(wide[:8], "little"), wide[8:]  # noqa: PLW2901 - what the field says counts
        values.append(value)
    return values[1], values[0], values[2]


def _zip64(name: str, fields: bytes) -> bytes:
    """Return the bytes of the ZIP64 field, or b"". Fields must be complete, and this one occurs at most once."""
    found: bytes | None = None
    while fields:
        kind, length = _FIELD.unpack_from(fields) if len(fields) >= _FIELD.size else (0, len(fields))
        if len(fields) < _FIELD.size + length or (kind == _ZIP64_ID and found is not None):
            raise ValueError(f"{name!r} has damaged extra fields")
        if kind == _ZIP64_ID:
            found = fields[_FIELD.size : _FIELD.size + length]
        fields = fields[_FIELD.size + length :]
    return found or b""


def _start(file: BinaryIO, entry: ZipEntry, following: int) -> int:
    """Return the position of a file's bytes. Its local header must match the directory, without a gap."""
    name = entry.name
    file.seek(entry.header_bytes)
    data = file.read(_LOCAL.size)
    if len(data) < _LOCAL.size:
        raise ValueError(f"{name!r} begins beyond the end of the zip")
    magic, _, flags, method, _, _, crc, packed, size, name_bytes, extra = _LOCAL.unpack(data)
    if magic != b"PK\x03\x04" or file.read(name_bytes) != name.encode("ascii"):
        raise ValueError(f"{name!r} has another name at its place")
    packed, size, _ = _widened(name, file.read(extra), packed=packed, size=size, start=0)
    if (flags, method, crc, packed, size) != (entry.flags, 0, entry.crc32, entry.size_bytes, entry.size_bytes):
        raise ValueError(f"{name!r} has another CRC, size or kind at its place than in the directory")
    start = entry.header_bytes + _LOCAL.size + int(name_bytes) + int(extra)
    if start + entry.size_bytes != following:
        raise ValueError(f"{name!r} does not end where the next file or the directory begins")
    return start
