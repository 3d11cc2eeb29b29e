"""The index of bricks on demand: a record of 24 bytes for each brick, little-endian."""

import numpy as np
from numpy.typing import NDArray

LOSS_FOOTPRINTS = (1, 2, 4, 8)
"""Widths of a pixel, in voxels of the brick, for which a record states the loss."""
RECORD = np.dtype(
    [
        ("size_bytes", "<u4"),
        ("crc32", "<u4"),
        ("low", "<u2"),
        ("high", "<u2"),
        ("loss", "<f2", (len(LOSS_FOOTPRINTS),)),
        ("opacity_xyz", "u1", (3,)),
        ("cover", "u1"),
    ]
)
"""Bytes of the brick in its file, or 0; CRC-32 of them; least and greatest code; loss of light if the brick is drawn
from the next coarser level, by the width of a pixel; opacity along x, y and z, and the part of the screen in front of
the brick in which something is seen, in 255ths."""
RECORD_BYTES = RECORD.itemsize

Records = NDArray[np.void]


def decode_index(data: bytes) -> Records:
    """Return the records of an index, whose size has been checked."""
    return np.frombuffer(data, RECORD)
