"""Deflated data sets of DICOM, inflated up to a limit. Source: DICOM PS3.5, A.5."""

import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

from volprep_formats.readers.dicom.header import MAX_SLICE_PIXELS

DEFLATED = "1.2.840.10008.1.2.1.99"
"""Its transfer syntax."""

_META_OFFSET_BYTES = 128 + 4 + 12
"""Preamble, "DICM", and the element that holds the length of the rest of group 0002."""
_PIECE_BYTES = 2**20
_MAX_INFLATED_BYTES = 2 * MAX_SLICE_PIXELS + 2**26


def inflated_data_set(path: Path) -> BinaryIO:
    """Return the inflated data set of a deflated file, as a file without a name that vanishes when it is closed.

    Memory stays at a few MB, whatever the file claims. Raises zlib.error when it is damaged, cut off, or larger than
    the largest slice that would be accepted.
    """
    # pydicom seeks in it, so that it is whole before it is read.
    target = tempfile.TemporaryFile()  # noqa: SIM115 - the caller closes it
    try:
        for piece in _pieces(path):
            target.write(piece)
    except BaseException:
        target.close()
        raise
    target.seek(0)
    return cast("BinaryIO", target)


def inflate_into(path: Path, offset_bytes: int, target: memoryview) -> int:
    """Write the inflated data set from `offset_bytes` on to `target`, and return how many bytes of it are filled.

    No more than a piece is held beside `target`. Raises zlib.error as above.
    """
    count, at = 0, 0
    for piece in _pieces(path):
        part = piece[max(0, offset_bytes - at) :][: len(target) - count]
        target[count : count + len(part)] = part
        count += len(part)
        at += len(piece)
        if count == len(target):
            break
    return count


def _pieces(path: Path) -> Iterator[bytes]:
    """Give the inflated data set piece by piece."""
    stream, size = zlib.decompressobj(-zlib.MAX_WBITS), 0
    with path.open("rb") as file:
        file.seek(meta_end_bytes(file.read(_META_OFFSET_BYTES)))
        while not stream.eof:
            packed = stream.unconsumed_tail or file.read(_PIECE_BYTES)
            piece = stream.decompress(packed, _PIECE_BYTES)
            size += len(piece)
            if size > _MAX_INFLATED_BYTES or not (packed or piece):
                msg = "cut off, or larger than the largest slice"
                raise zlib.error(msg)
            yield piece


def meta_end_bytes(head: bytes) -> int:
    """End of group 0002. Its first element is required, and holds the length of the others."""
    return _META_OFFSET_BYTES + int.from_bytes(head[_META_OFFSET_BYTES - 4 : _META_OFFSET_BYTES], "little")
