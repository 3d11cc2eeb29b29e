"""Deflated data sets of DICOM, inflated up to a limit. Source: DICOM PS3.5, A.5."""

import zlib
from pathlib import Path

from volprep_formats.readers.dicom.header import MAX_SLICE_PIXELS

DEFLATED = "1.2.840.10008.1.2.1.99"
"""Its transfer syntax."""

_META_OFFSET_BYTES = 128 + 4 + 12
"""Preamble, "DICM", and the element that holds the length of the rest of group 0002."""
_MAX_INFLATED_BYTES = 2 * MAX_SLICE_PIXELS + 2**26


def inflated_data_set(path: Path) -> bytes:
    """Inflate the data set of a deflated file.

    Raises zlib.error when it is damaged, cut off, or larger than the largest slice that would be accepted.
    """
    with path.open("rb") as file:
        file.seek(meta_end_bytes(file.read(_META_OFFSET_BYTES)))
        stream = zlib.decompressobj(-zlib.MAX_WBITS)
        data = stream.decompress(file.read(), _MAX_INFLATED_BYTES)
    if not stream.eof:
        msg = "cut off, or larger than the largest slice"
        raise zlib.error(msg)
    return data


def meta_end_bytes(head: bytes) -> int:
    """Where group 0002 ends: its first element, which must be there, holds the length of the others."""
    return _META_OFFSET_BYTES + int.from_bytes(head[_META_OFFSET_BYTES - 4 : _META_OFFSET_BYTES], "little")
