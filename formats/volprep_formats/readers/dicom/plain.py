"""The header of a plain DICOM file: one image, little endian, nothing unusual. All others are left to pydicom.

Most files are plain, and of theirs a few elements are wanted. Native code walks over the others, in several files at a
time; pydicom takes thirty times as long, and a while to load. Whatever is out of the ordinary (no prefix, another byte
order, frames, tags out of order, unknown types, lengths beyond the file) ends the walk, and is never interpreted here.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from volprep_formats import _dicom
from volprep_formats.readers.dicom.codecs import DECODERS, EXPLICIT, IMPLICIT
from volprep_formats.readers.dicom.element import UNDEFINED_LENGTH, PixelElement, native_element, pixel_element
from volprep_formats.readers.dicom.fields import PRIVATE_TAGS, TAGS, Elements, raw_text

_KEPT = (*TAGS.values(), *PRIVATE_TAGS)
_SYNTAXES = frozenset((IMPLICIT, EXPLICIT, *DECODERS))
_FILES_AT_ONCE = 8
"""Threads that read headers, however many cores there are: they wait for the disk."""


@dataclass(frozen=True)
class PlainHeader:
    """The needed elements of the header of a plain file."""

    transfer_syntax: str
    elements: Elements
    pixels: PixelElement


def plain_headers(paths: Sequence[Path]) -> list[PlainHeader | None]:
    """Read the headers of plain files; None for any other file, and for one that cannot be read."""
    found = _dicom.plain_headers([os.fsencode(path) for path in paths], _KEPT, _FILES_AT_ONCE)
    return [None if header is None else _plain(path, header) for path, header in zip(paths, found, strict=True)]


def _plain(path: Path, found: tuple[bytes, dict[int, bytes], bytes, int, int]) -> PlainHeader | None:
    """Take what the walk found: the element that holds the pixels begins with `pixels`, at `offset_bytes`."""
    syntax, values, pixels, offset_bytes, file_bytes = found
    transfer_syntax = syntax.decode("latin-1")
    elements = {tag: (value, "<") for tag, value in values.items()}
    if transfer_syntax not in _SYNTAXES or raw_text(elements, "NumberOfFrames") not in {"", "1"}:
        return None
    element: PixelElement | None = native_element(pixels, offset_bytes, file_bytes)
    if transfer_syntax in DECODERS or pixels[-4:] == UNDEFINED_LENGTH.to_bytes(4):
        try:
            with path.open("rb") as file:
                file.seek(offset_bytes)
                element = pixel_element(
                    file, transfer_syntax == IMPLICIT, little=True, encapsulated=transfer_syntax in DECODERS
                )
        except OSError:
            return None
    return None if element is None else PlainHeader(transfer_syntax, elements, element)
