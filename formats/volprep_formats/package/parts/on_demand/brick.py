"""A brick on its way: differences of neighbouring texels, byte by byte, as one Zstandard frame."""

import zlib

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Texels
from volprep_formats.package.parts.on_demand.record import OnDemand
from volprep_formats.textures.texel_formats import TEXELS
from volprep_formats.textures.zstd_frames import FrameError, compress, decompress

_EFFORT = 1
"""Of Zstandard. Level 7 takes four to eight times as long for differences, and packs up to 5 % denser or 2 % less dense
(docs/MEASURED.md)."""


def encode_brick(texels: Texels) -> bytes:
    """Return the bytes of a brick: the lower bytes of all texels, then the upper ones, each less the one before."""
    planes = np.ascontiguousarray(texels).view(np.uint8).reshape(-1, texels.dtype.itemsize).T
    differences = np.ascontiguousarray(np.diff(planes, axis=1, prepend=np.uint8(0)))
    return b"".join(compress(differences.data.cast("B"), _EFFORT))


def decode_brick(data: bytes, crc32: int, layout: OnDemand) -> NDArray[np.generic]:
    """Return the texels [z, y, x] of a brick. Raises FrameError where its bytes are damaged."""
    if zlib.crc32(data) != crc32:
        raise FrameError(f"its CRC-32 is {zlib.crc32(data):08x} instead of {crc32:08x}")
    planes = decompress(memoryview(data), layout.brick_bytes).reshape(-1, layout.pitch**3)
    texels = np.cumsum(planes, axis=1, dtype=np.uint8).T
    return np.ascontiguousarray(texels).view(TEXELS[layout.format].dtype).reshape((layout.pitch,) * 3)
