"""The directories of a TIFF file, as far as no decoder is needed: their number, and the description in the first.

A library that meets a broken link takes it for the end, and a stack that was cut off for a shorter one. Source: TIFF
revision 6.0, section 2; for files beyond 4 GB, the BigTIFF design of the libtiff project.
"""

import struct
from pathlib import Path
from typing import BinaryIO

from volprep_formats.regular_files import open_regular

_BIG = 43
_IMAGE_DESCRIPTION, _ASCII = 270, 2


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
            entries, begin = tiff.entries(tiff.first())
            for at in range(begin, begin + min(entries, 2**16) * tiff.entry_bytes, tiff.entry_bytes):
                if tiff.number("H", at) == _IMAGE_DESCRIPTION and tiff.number("H", at + 2) == _ASCII:
                    count = tiff.number(tiff.link_form, at + 4)
                    value = at + 4 + struct.calcsize(tiff.order + tiff.link_form)
                    inline = count <= struct.calcsize(tiff.order + tiff.link_form)
                    text = tiff.read(value if inline else tiff.number(tiff.link_form, value), min(count, most))
                    return text if len(text) == min(count, most) else None
        except (struct.error, OverflowError, OSError):  # cut off, or an offset that no file has
            return None
    return None
