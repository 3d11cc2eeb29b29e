"""A label table inside a NIfTI file: an extension with the XML of Caret, as TotalSegmentator writes it.

Source: nifti1.h, "Data storage: extended header", NIFTI_ECODE_CARET. Some writers give their XML another code.
"""

import struct
from contextlib import suppress
from gzip import GzipFile
from io import BufferedReader
from pathlib import Path

from volprep_formats.regular_files import open_unpacked

_MOST_BYTES = 2**22
"""Largest part of a file before its voxels that is read."""
_HEAD_BYTES = 544
"""Header of version 2 and the mark of its extensions."""
_TABLE = b"<LabelTable"


def table_text(path: Path) -> str:
    """Return the extension of a NIfTI file that has a label table; empty for any other file."""
    if not path.name.lower().endswith((".nii", ".nii.gz")):
        return ""
    with suppress(OSError, EOFError, ValueError, struct.error, OverflowError), open_unpacked(path) as file:
        return next((text.decode("utf-8", "replace") for text in _extensions(file) if _TABLE in text), "")
    return ""


def _extensions(file: GzipFile | BufferedReader) -> list[bytes]:
    """Return the contents of the extensions. Of a file without any, as most are, only the header is read.

    Raises ValueError or struct.error where the file ends too early.
    """
    from volprep_formats.nifti_header import is_nifti, parsed  # noqa: PLC0415 - it loads NumPy, presets do not need it

    head = file.read(_HEAD_BYTES)
    header = parsed(head)
    size = header.dtype.itemsize
    if not is_nifti(header) or not any(head[size : size + 1]):
        return []
    end, order = int(header["vox_offset"]), header["dim"].dtype.byteorder
    head += file.read(max(min(end, _MOST_BYTES) - _HEAD_BYTES, 0))
    found = []
    start = size + 4
    while start + 8 <= min(end, len(head)):
        (length,) = struct.unpack_from(order + "i", head, start)
        if length < 8:
            break
        found.append(head[start + 8 : start + length])
        start += length
    return found
