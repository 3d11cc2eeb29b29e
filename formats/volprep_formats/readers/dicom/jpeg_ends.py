"""Detect truncated JPEG data, which decoders complete without a warning.

The coded pixels of a complete picture end before its end marker, so extra bits between the two change nothing. In a
picture that was cut off and given an end marker, the coded pixels continue with the extra bits. Such bits are inserted
there and before every restart marker; the decoded picture must stay the same. Source: ITU-T T.81 (B.1.1, E.1, E.2,
H.1).
"""

import numpy as np

from volprep_formats.readers.dicom.codestreams import Declared, scan_of

_RESTARTS = range(0xD0, 0xD8)
_END = 0xD9
# A decoder that runs out of data goes on with zeros, so the first bit is one: where a code begins, it is another code.
# No byte is 0xFF, after which a decoder would look for a marker.
_OTHER_BITS = bytes(0x80 | k * 37 % 127 if k % 2 == 0 else k * 53 % 251 for k in range(64))


def with_other_bits(frame: bytes, said: Declared) -> bytes | None:
    """The data of one picture with other bits after each part of them; None if they cannot be whole.

    They are not whole without an end marker, or when restart markers are missing.
    """
    scan = scan_of(frame)
    if scan is None:
        return None
    parts, begin = [frame[: scan.start]], scan.start
    for restarts, at in enumerate(_markers(frame, scan.start)):
        kind = frame[at + 1]
        parts += [frame[begin:at].rstrip(b"\xff"), _OTHER_BITS, frame[at : at + 2]]
        begin = at + 2
        if kind not in _RESTARTS:
            is_whole = kind == _END and restarts == _expected_restarts(said, scan.restart_interval)
            return b"".join(parts) if is_whole else None
        if kind != _RESTARTS[restarts % 8]:
            return None
    return None


def _markers(frame: bytes, start: int) -> list[int]:
    """Places of the markers from `start` on: where a byte of all ones is followed neither by zero nor by another."""
    data = np.frombuffer(frame, np.uint8, offset=start)
    places: list[int] = (np.flatnonzero((data[:-1] == 0xFF) & (data[1:] - 1 < 0xFE)) + start).tolist()
    return places


def _expected_restarts(said: Declared, interval: int) -> int:
    """Number of restart markers in a picture of one scan, whose units are pixels or 8×8 blocks or several of them."""
    if not interval:
        return 0
    side = 1 if said.coding == "lossless" else 8
    # A component alone is coded block by block, whatever its factors.
    y, x = (side * value if said.components > 1 else side for value in said.unit_yx)
    units = -(-said.rows // y) * -(-said.columns // x)
    return -(-units // interval) - 1
