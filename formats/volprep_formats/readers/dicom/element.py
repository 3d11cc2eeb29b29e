"""The element that holds the pixels of a DICOM file: its position, and whether it is complete."""

import io
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import BinaryIO

PIXEL_DATA = 0x7FE0_0010
"""Tag of the element that holds pixels, where these are integers; others of its group hold floats."""
UNDEFINED_LENGTH = 0xFFFF_FFFF
"""Length of a value that ends with a delimiter."""

_ITEM, _SEQUENCE_END = 0xFFFE_E000, 0xFFFE_E0DD
_PIXEL_GROUP = PIXEL_DATA >> 16
_MOST_ITEMS = 2**20


@dataclass(frozen=True)
class PixelElement:
    """The element that holds the pixels: its position in the file, or in the inflated data set."""

    is_float: bool
    """FloatPixelData or DoubleFloatPixelData."""
    has_words: bool
    """Its values are 16-bit words (VR OW)."""
    offset_bytes: int
    size_bytes: int | None
    """Length of the value, of an encapsulated one with its items and the delimiter; None when the file ends first."""
    present_bytes: int
    """Bytes of the value that are in the file."""
    items: tuple[tuple[int, int], ...]
    """Offset and length of the value of each item of an encapsulated value; the first is its table."""
    table: tuple[int, ...]
    """The table: where each frame begins, counted from the end of the table; it may be empty."""


def pixel_element(stream: BinaryIO, implicit: bool, little: bool, *, encapsulated: bool) -> PixelElement | None:
    """Find the pixel data, which begins where `stream` stands; None when the file ends before it."""
    start = stream.tell()
    size = stream.seek(0, io.SEEK_END)
    stream.seek(start)
    header = stream.read(8 if implicit else 12)
    if len(header) < (8 if implicit else 12):
        return None
    element = native_element(header, start, size, little=little)
    if element is None or not (encapsulated or header[-4:] == UNDEFINED_LENGTH.to_bytes(4)):
        return element
    items: list[tuple[int, int]] = []
    end = _walk(stream, size, items)
    size_bytes = None if end > size else end - element.offset_bytes
    return replace(element, size_bytes=size_bytes, items=tuple(items), table=_table(stream, items))


def native_element(header: bytes, start: int, file_bytes: int, *, little: bool = True) -> PixelElement | None:
    """Interpret the bytes at `start` as pixel data that is not encapsulated, or return None.

    `header` is tag, type and length (12 bytes), or tag and length (8 bytes).
    """
    order = "<" if little else ">"
    group, number = struct.unpack(order + "HH", header[:4])
    if group != _PIXEL_GROUP:
        return None
    (length,) = struct.unpack(order + "L", header[-4:])
    offset_bytes = start + len(header)
    return PixelElement(
        is_float=group << 16 | number != PIXEL_DATA,
        has_words=len(header) == 12 and header[4:6] == b"OW",
        offset_bytes=offset_bytes,
        size_bytes=None if offset_bytes + length > file_bytes else length,
        present_bytes=file_bytes - offset_bytes,
        items=(),
        table=(),
    )


def _walk(stream: BinaryIO, size: int, items: list[tuple[int, int]]) -> int:
    """Collect the items of encapsulated pixel data; give the end of its delimiter, past `size` when it is cut off."""
    while len(items) < _MOST_ITEMS:
        header = stream.read(8)
        if len(header) < 8:
            return size + 1
        group, number, length = struct.unpack("<HHL", header)
        tag = group << 16 | number
        if tag == _SEQUENCE_END:
            return stream.tell()
        if tag != _ITEM:
            return size + 1
        items.append((stream.tell(), length))
        stream.seek(length, io.SEEK_CUR)
    return size + 1


def _table(stream: BinaryIO, items: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Basic offset table, the value of the first item."""
    if not items or items[0][1] % 4 or items[0][1] > 4 * _MOST_ITEMS:
        return ()
    stream.seek(items[0][0])
    value = stream.read(items[0][1])
    return struct.unpack(f"<{len(value) // 4}L", value) if len(value) == items[0][1] else ()
