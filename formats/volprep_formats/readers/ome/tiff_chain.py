"""The directories of a TIFF file, as far as no decoder is needed: their number, and the description in the first.

A library that meets a broken link takes it for the end, and a stack that was cut off for a shorter one. Source: TIFF
revision 6.0, section 2; for files beyond 4 GB, the BigTIFF design of the libtiff project.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Literal

from volprep_formats.regular_files import open_regular

_BIG = 43
_IMAGE_DESCRIPTION, _ASCII = 270, 2
_COMPRESSION, _NOT_COMPRESSED, _STRIP_OFFSETS = 259, 1, 273
_FORMS = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""Types of whole numbers."""


class _Tiff:
    """An open TIFF file of either size."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        head = file.read(16)
        self.order = "<" if head[:2] == b"II" else ">"
        self.is_big = len(head) == 16 and struct.unpack_from(self.order + "H", head, 2)[0] == _BIG
        self.count_form, self.link_form, self.entry_bytes = ("Q", "Q", 20) if self.is_big else ("H", "I", 12)

    def number(self, form: str, offset: int) -> int:
        """Number at some place. Raises struct.error beyond the end."""
        return int(struct.unpack(self.order + form, self.read(offset, struct.calcsize(self.order + form)))[0])

    def read(self, offset: int, count: int) -> bytes:
        """Bytes at some place; fewer beyond the end."""
        self._file.seek(offset)
        return self._file.read(count)

    def first(self) -> int:
        """Offset of the first directory."""
        return self.number(self.link_form, 8 if self.is_big else 4)

    def entries(self, at: int) -> tuple[int, int]:
        """Number of entries of the directory at `at`, and where they begin."""
        return self.number(self.count_form, at), at + struct.calcsize(self.order + self.count_form)

    def tags_of_first(self) -> Iterator[tuple[int, int, int, int]]:
        """Tag, type, number of values and place of the values of each entry of the first directory."""
        entries, begin = self.entries(self.first())
        link_bytes = struct.calcsize(self.order + self.link_form)
        for at in range(begin, begin + min(entries, 2**16) * self.entry_bytes, self.entry_bytes):
            kind, count = self.number("H", at + 2), self.number(self.link_form, at + 4)
            value = at + 4 + link_bytes
            value_bytes = count * (struct.calcsize(_FORMS[kind]) if kind in _FORMS else 1)
            yield (
                self.number("H", at),
                kind,
                count,
                value if value_bytes <= link_bytes else self.number(self.link_form, value),
            )


def count_pages(path: Path, most: int) -> int | None:
    """Number of directories, at most `most` + 1; None when a link of the chain leads nowhere or back."""
    size = path.stat().st_size
    with open_regular(path) as file:
        tiff = _Tiff(file)
        seen: set[int] = set()
        try:
            at = tiff.first()
            while at and len(seen) <= most:
                entries, begin = tiff.entries(at)
                after = begin + entries * tiff.entry_bytes
                if at in seen or after > size:
                    return None
                seen.add(at)
                at = tiff.number(tiff.link_form, after)
        except struct.error:  # cut off
            return None
    return len(seen)


def description_of(path: Path, most: int) -> bytes | None:
    """Text of the first page, at most `most` bytes; None if it is missing or lies beyond the end."""
    with open_regular(path) as file:
        tiff = _Tiff(file)
        try:
            for tag, kind, count, place in tiff.tags_of_first():
                if (tag, kind) == (_IMAGE_DESCRIPTION, _ASCII):
                    text = tiff.read(place, min(count, most))
                    return text if len(text) == min(count, most) else None
        except (struct.error, OverflowError, OSError):  # cut off, or an offset that no file has
            return None
    return None


def data_of_first_page(path: Path) -> tuple[int, Literal["<", ">"]] | None:
    """Where the data of the first page begin, and their byte order; None unless they are one strip, not compressed."""
    with open_regular(path) as file:
        tiff = _Tiff(file)
        try:
            told = {
                tag: tiff.number(_FORMS[kind], place)
                for tag, kind, count, place in tiff.tags_of_first()
                if tag in {_COMPRESSION, _STRIP_OFFSETS} and count == 1 and kind in _FORMS
            }
        except (struct.error, OverflowError, OSError):  # cut off, or an offset that no file has
            return None
    if told.get(_COMPRESSION, _NOT_COMPRESSED) != _NOT_COMPRESSED or _STRIP_OFFSETS not in told:
        return None
    return told[_STRIP_OFFSETS], "<" if tiff.order == "<" else ">"
