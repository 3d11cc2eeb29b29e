"""Quick walk over the header of an ordinary DICOM file: little endian, with every length defined.

It gives what pydicom would give, three times as fast, and nothing at all where a file is in any way unusual: such a
file is for pydicom. Nothing is interpreted here. Source: DICOM PS3.10, 7.1; PS3.5, 7.1.
"""

import struct
from dataclasses import dataclass

from pydicom.dataelem import DataElement, RawDataElement
from pydicom.dataset import Dataset
from pydicom.tag import BaseTag
from pydicom.uid import UID, ExplicitVRBigEndian, ImplicitVRLittleEndian

from volprep_formats.readers.dicom_header import PRIVATE_TAGS, TAGS

_PIXEL_GROUP, _PIXEL_DATA = 0x7FE0, 0x7FE00010
_UNDEFINED_LENGTH = 0xFFFFFFFF
_META_LENGTH, _SYNTAX = 0x00020000, 0x00020010
_META_AT = 144
"""Where the elements begin that the length of group 0002 counts."""
_DEFLATED = "1.2.840.10008.1.2.1.99"
_LONG = frozenset(b"OB OD OF OL OV OW SQ SV UC UN UR UT UV".split())
_SHORT = frozenset(b"AE AS AT CS DA DS DT FD FL IS LO LT PN SH SL SS ST TM UI UL US".split())


_WANTED = {int(tag): tag for tag in (*TAGS.values(), *PRIVATE_TAGS)}
_SEQUENCES = frozenset(int(tag) for keyword, tag in TAGS.items() if keyword.endswith("Sequence"))


@dataclass(frozen=True)
class Header:
    """The elements of one file that were asked for, as they stand in it."""

    data: Dataset
    syntax: UID
    """Transfer syntax."""
    is_implicit: bool
    pixels_at: int
    """Where the element of the pixel data begins."""


def walk_header(head: bytes) -> Header | None:
    """Walk over the header that begins the file, if all of it lies in `head` and is ordinary; None otherwise."""
    try:
        return _walk(head) if head[128:132] == b"DICM" else None
    except (ValueError, struct.error):
        return None


def _walk(head: bytes) -> Header:
    """Walk over a header. Raises ValueError or struct.error where it is unusual."""
    syntax, at = _meta(head)
    implicit = syntax == ImplicitVRLittleEndian
    step = _implicit if implicit else _explicit
    elements: dict[BaseTag, DataElement | RawDataElement] = {}
    while True:
        tag, kind, start, end = step(head, at)
        if tag >> 16 == _PIXEL_GROUP:
            break
        if tag in _SEQUENCES:
            raise ValueError
        wanted = _WANTED.get(tag)
        if wanted is not None:
            elements[wanted] = RawDataElement(wanted, kind, end - start, head[start:end], start, implicit, True)
        at = end
    if tag != _PIXEL_DATA:
        raise ValueError
    return Header(Dataset(elements), syntax, implicit, at)


def _meta(head: bytes) -> tuple[UID, int]:
    """Transfer syntax, and where the data set begins, which must be what the syntax says."""
    meta: dict[int, bytes] = {}
    at = 132
    while head[at : at + 2] == b"\x02\0":
        tag, _, start, end = _explicit(head, at)
        meta[tag] = head[start:end]
        at = end
    syntax = UID(meta.get(_SYNTAX, b"").decode("latin-1").strip(" \0"))
    is_explicit = head[at + 4 : at + 6] in _LONG | _SHORT
    if not syntax.is_transfer_syntax or syntax in {ExplicitVRBigEndian, _DEFLATED}:
        raise ValueError
    if is_explicit == (syntax == ImplicitVRLittleEndian) or struct.pack("<L", at - _META_AT) != meta.get(_META_LENGTH):
        raise ValueError
    return syntax, at


def _explicit(head: bytes, at: int) -> tuple[int, str | None, int, int]:
    """Tag, type, begin and end of the value of the element at `at`. Raises ValueError where it is unusual."""
    group, element, kind, length = struct.unpack_from("<HH2sH", head, at)
    start = at + 8
    if kind in _LONG:
        (length,) = struct.unpack_from("<L", head, start)
        start += 4
    elif kind not in _SHORT:
        raise ValueError
    tag = group << 16 | element
    return tag, kind.decode(), start, _end(head, tag, start, length)


def _implicit(head: bytes, at: int) -> tuple[int, str | None, int, int]:
    group, element, length = struct.unpack_from("<HHL", head, at)
    tag = group << 16 | element
    return tag, None, at + 8, _end(head, tag, at + 8, length)


def _end(head: bytes, tag: int, start: int, length: int) -> int:
    if tag >> 16 == _PIXEL_GROUP:
        return start
    if length == _UNDEFINED_LENGTH or length % 2 or start + length > len(head):
        raise ValueError
    return start + length
