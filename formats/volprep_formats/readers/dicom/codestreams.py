"""Picture sizes that JPEG, JPEG-LS and JPEG 2000 data declare, read without decoding anything.

A decoder allocates what its data declares, whatever the file around them says. Sources: ITU-T T.81 (B.2.2, frame
header), T.87 (C.2.2), T.800 (A.5.1, SIZ).
"""

import struct
from dataclasses import dataclass

_SOI, _SOC_SIZ = b"\xff\xd8", b"\xff\x4f\xff\x51"
_JP2_SIGNATURE = b"\0\0\0\x0cjP  \r\n\x87\n"
_LARGEST_JP2_HEADER = 4096
# Start of frame: C0 to CF without tables (C4), extensions (C8) and arithmetic conditioning (CC); F7 is JPEG-LS.
_FRAMES = frozenset((*range(0xC0, 0xD0), 0xF7)) - {0xC4, 0xC8, 0xCC}
_ENTROPY_CODED = 0xDA


@dataclass(frozen=True)
class DeclaredSize:
    """What a codestream says about itself."""

    rows: int
    columns: int
    components: int


def declared_size(data: bytes) -> DeclaredSize | None:
    """Size in the first frame header of JPEG or JPEG-LS, or the SIZ segment of JPEG 2000; None if there is none."""
    if data[:2] == _SOI:
        return _jpeg_size(data)
    start = data.find(_SOC_SIZ, 0, _LARGEST_JP2_HEADER) if data.startswith(_JP2_SIGNATURE) else 0
    if start < 0 or data[start : start + 4] != _SOC_SIZ or len(data) < start + 42:
        return None
    # Length, capabilities; size and offset of the image on the grid; size and offset of the tiles; components.
    right, bottom, left, top, *_, components = struct.unpack_from(">8LH", data, start + 8)
    return DeclaredSize(bottom - top, right - left, components)


def _jpeg_size(data: bytes) -> DeclaredSize | None:
    at = 2
    while at + 10 <= len(data):
        if data[at] != 0xFF:
            return None
        marker = data[at + 1]
        if marker == 0xFF:  # a fill byte
            at += 1
            continue
        if marker in _FRAMES:
            rows, columns, components = struct.unpack_from(">HHB", data, at + 5)
            return DeclaredSize(rows, columns, components)
        if marker == _ENTROPY_CODED:
            return None
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return None
