"""Picture size and type declared by JPEG, JPEG-LS and JPEG 2000 data, read without decoding.

A decoder allocates the declared size, whatever the surrounding file declares. Sources: ITU-T T.81 (B.2.2, frame
header), T.87 (C.2.2), T.800 (A.5.1, SIZ).
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

_SOI, _SOC_SIZ = b"\xff\xd8", b"\xff\x4f\xff\x51"
_JP2_SIGNATURE = b"\0\0\0\x0cjP  \r\n\x87\n"
_LARGEST_JP2_HEADER = 4096
# Start of frame: C0 to CF without tables (C4), extensions (C8) and arithmetic conditioning (CC); F7 is JPEG-LS.
_FRAMES = frozenset((*range(0xC0, 0xD0), 0xF7)) - {0xC4, 0xC8, 0xCC}
_INTERVAL, _ENTROPY_CODED, _JFIF, _ADOBE = 0xDD, 0xDA, 0xE0, 0xEE

MOST_TILES = 65535
"""Largest number of tiles in JPEG 2000."""

Coding = Literal["sequential DCT", "lossless", "JPEG-LS", "JPEG 2000", "another process of JPEG"]
_CODINGS: dict[int, Coding] = {0xC0: "sequential DCT", 0xC1: "sequential DCT", 0xC3: "lossless", 0xF7: "JPEG-LS"}


@dataclass(frozen=True)
class Declared:
    """Picture properties that a codestream declares."""

    coding: Coding
    rows: int
    columns: int
    components: int
    precision: int
    """Bits of each value."""
    signed: bool
    """Only JPEG 2000 can declare signed values."""
    tiles: int = 1
    """Number of tiles of JPEG 2000; above the limit if the tile size is invalid."""
    unit_yx: tuple[int, int] = (1, 1)
    """Largest sampling factors of JPEG: rows and columns of blocks, or of pixels, that are coded together."""


@dataclass(frozen=True)
class JpegScan:
    """Position of the coded pixels of a JPEG picture."""

    start: int
    restart_interval: int
    """Number of units between two restart markers; 0 without restart markers."""


def declared(data: bytes) -> Declared | None:
    """Return the content of the first frame header of JPEG or JPEG-LS, or of the SIZ segment of JPEG 2000, or None."""
    if data[:2] == _SOI:
        return _jpeg(data)
    start = data.find(_SOC_SIZ, 0, _LARGEST_JP2_HEADER) if data.startswith(_JP2_SIGNATURE) else 0
    if start < 0 or data[start : start + 4] != _SOC_SIZ or len(data) < start + 43:
        return None
    # Length, capabilities; size and offset of the image on the grid; size and offset of the tiles; components.
    right, bottom, left, top, width, height, tiles_left, tiles_top, components = struct.unpack_from(
        ">8LH", data, start + 8
    )
    is_sound = width > 0 and height > 0 and tiles_left <= left and tiles_top <= top
    tiles = -(-(right - tiles_left) // width) * -(-(bottom - tiles_top) // height) if is_sound else MOST_TILES + 1
    depth = data[start + 42]
    return Declared("JPEG 2000", bottom - top, right - left, components, (depth & 0x7F) + 1, bool(depth & 0x80), tiles)


def scan_of(data: bytes) -> JpegScan | None:
    """Return the position of the first scan of JPEG data, or None."""
    interval = 0
    for marker, at, length in _segments(data):
        if marker == _INTERVAL and length == 4:
            (interval,) = struct.unpack_from(">H", data, at + 4)
        elif marker == _ENTROPY_CODED:
            return JpegScan(at + 2 + length, interval)
    return None


def jpeg_transform(data: bytes) -> bool | None:
    """Return whether the markers of JPEG data say luminance and differences, or colours; None if they say neither.

    Source: ITU-T T.872, 6.5.3 (Adobe's marker) and T.871 (JFIF, whose colours are luminance and differences).
    """
    has_jfif = False
    for marker, at, length in _segments(data):
        if marker == _ADOBE and length >= 14 and data[at + 4 : at + 9] == b"Adobe":
            return data[at + 15] != 0
        has_jfif |= marker == _JFIF and data[at + 4 : at + 9] == b"JFIF\0"
        if marker in {*_FRAMES, _ENTROPY_CODED}:
            break
    return True if has_jfif else None


def _jpeg(data: bytes) -> Declared | None:
    for marker, at, length in _segments(data):
        if marker in _FRAMES and length >= 8:
            precision, rows, columns, components = struct.unpack_from(">BHHB", data, at + 4)
            coding = _CODINGS.get(marker, "another process of JPEG")
            factors = data[at + 11 : at + 2 + length : 3]
            unit = max(1, 1, *(factor & 15 for factor in factors)), max(1, 1, *(factor >> 4 for factor in factors))
            return Declared(coding, rows, columns, components, precision, signed=False, unit_yx=unit)
        if marker == _ENTROPY_CODED:
            return None
    return None


def _segments(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield marker, position and length of each segment before the end, as far as they are valid."""
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:  # a fill byte
            at += 1
            continue
        length = int.from_bytes(data[at + 2 : at + 4], "big")
        if length < 2 or at + 2 + length > len(data):
            return
        yield marker, at, length
        at += 2 + length
