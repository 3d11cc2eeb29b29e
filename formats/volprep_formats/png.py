"""8-bit sRGB pictures as PNG files, for people only: data is never stored in a PNG.

Source: PNG specification (W3C, second edition): chunks (5), filters (9), and the choice of a filter for each row
(12.8). The file is made in memory, so that the caller can check that all of it was written.
"""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import require_place

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_COLOUR_TYPES = {1: 0, 3: 2, 4: 6}
_PERCEPTUAL = b"\x00"
_ROWS = 64
"""Rows that are filtered at a time: all at once would take ten times the memory of the picture."""


def require_png_place(path: Path) -> None:
    """Refuse a picture that cannot be written, before work is done for it.

    Raises VP5021 where the name does not end in .png or the folder takes no file, VP4060 where something other than a
    file has the name.
    """
    if path.suffix.lower() != ".png":
        raise VolprepError("VP5021", path=path, error="pictures are PNG files, whose names end in .png")
    require_place(path, "VP5021")


def png_bytes(picture: UInt8Array) -> bytes:
    """Return the PNG file of a picture, row 0 on top: [H, W, 1], [H, W, 3], or [H, W, 4].

    Colours are not multiplied by alpha.
    """
    height, width, channels = picture.shape
    header = struct.pack(">2I5B", width, height, 8, _COLOUR_TYPES[channels], 0, 0, 0)
    # Bytes after a filter are small numbers, for which zlib has a strategy: slices of a CT take 5 % less.
    stream = zlib.compressobj(level=6, strategy=zlib.Z_FILTERED)
    rows = np.ascontiguousarray(picture).reshape(height, width * channels)
    packed = b"".join(stream.compress(block) for block in _filtered(rows, channels)) + stream.flush()
    chunks = ((b"IHDR", header), (b"sRGB", _PERCEPTUAL), (b"IDAT", packed), (b"IEND", b""))
    return _SIGNATURE + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _filtered(rows: UInt8Array, channels: int) -> Iterator[bytes]:
    """Each row with the filter in front that leaves the smallest numbers."""
    height, row_bytes = rows.shape
    # A pixel of zeros to the left, a row of zeros above.
    padded = np.zeros((height + 1, row_bytes + channels), np.uint8)
    padded[1:, channels:] = rows
    for y in range(0, height, _ROWS):
        part = padded[y : y + _ROWS + 1].astype(np.int16)
        here, left = part[1:, channels:], part[1:, :-channels]
        above, corner = part[:-1, channels:], part[:-1, :-channels]
        predicted = (0, left, above, (left + above) >> 1, _paeth(left, above, corner))
        filtered = np.stack([(here - value).astype(np.uint8) for value in predicted])
        best = np.abs(filtered.view(np.int8).astype(np.int16)).sum(axis=2, dtype=np.int64).argmin(axis=0)
        chosen = filtered[best, np.arange(len(best))]
        yield np.concatenate([best.astype(np.uint8)[:, None], chosen], axis=1).tobytes()


def _paeth(left: NDArray[np.int16], above: NDArray[np.int16], corner: NDArray[np.int16]) -> NDArray[np.int16]:
    """Return whichever of the three is nearest to left + above - corner, in this order."""
    to_left, to_above = np.abs(above - corner), np.abs(left - corner)
    to_corner = np.abs(left + above - 2 * corner)
    other = np.where(to_above <= to_corner, above, corner)
    return np.where((to_left <= to_above) & (to_left <= to_corner), left, other)


def png_problem(data: bytes, width: int, height: int, channels: int) -> str | None:
    """Say why `data` is not a file that `png_bytes` writes for a picture of this size; None if it is one.

    The header is compared before anything is decompressed, and no more bytes are than the picture has. A file that
    passes has these chunks and no others: text, gamma, animations and bytes behind the end are refused.
    """
    header = struct.pack(">2I5B", width, height, 8, _COLOUR_TYPES[channels], 0, 0, 0)
    start = _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"sRGB", _PERCEPTUAL)
    end = _chunk(b"IEND", b"")
    if not data.startswith(start):
        return f"does not begin as an 8-bit sRGB picture of {width}×{height} pixels"
    if not data.endswith(end) or len(data) < len(start) + 12 + len(end):
        return "does not end as a picture"
    body = data[len(start) : -len(end)]
    packed = body[8:-4]
    if body != _chunk(b"IDAT", packed):
        return "has more than one chunk of pixels, other chunks, or a wrong checksum"
    wanted = height * (1 + width * channels)
    stream = zlib.decompressobj()
    try:
        rows = stream.decompress(packed, wanted + 1)
    except zlib.error as error:
        return f"cannot be decompressed: {error}"
    if len(rows) != wanted or not stream.eof or stream.unused_data:
        return f"does not hold the {wanted} bytes of its pixels, and nothing else"
    return None
