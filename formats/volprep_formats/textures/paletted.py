"""Paletted textures of OpenGL ES 1: the bytes that glCompressedTexImage2D takes for GL_PALETTE8_RGBA8_OES.

GL_OES_compressed_paletted_texture, which every OpenGL ES 1.1 has: 256 colours of four bytes, then one byte for each
texel, row 0 first. KTX 2 has no such format, so that the file is these bytes and nothing else.
"""

from collections.abc import Iterator
from typing import NoReturn

import numpy as np

from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError

ENTRIES = 256
"""Colours of a palette; a shorter one is filled with zeros."""
PALETTE_BYTES = 4 * ENTRIES
"""Size of the palette, before the texels."""


def encode(colours: UInt8Array, indices: UInt8Array) -> Iterator[bytes | memoryview]:
    """Return the parts of the file of colours [entry, RGBA] and indices [y, x]."""
    palette = np.zeros((ENTRIES, 4), np.uint8)
    palette[: len(colours)] = colours
    yield palette.tobytes()
    yield np.ascontiguousarray(indices).data.cast("B")


def decode(data: bytes, shape_yx: tuple[int, int], name: str) -> tuple[UInt8Array, UInt8Array]:
    """Return colours [256, RGBA] and indices [y, x] of a file. Raises VP4031 for a file of another size."""
    height, width = shape_yx
    if len(data) != PALETTE_BYTES + height * width:
        _fail(name, f"{len(data)} bytes, expected {PALETTE_BYTES + height * width} for {width}×{height} texels")
    colours = np.frombuffer(data, np.uint8, PALETTE_BYTES).reshape(ENTRIES, 4)
    return colours, np.frombuffer(data, np.uint8, offset=PALETTE_BYTES).reshape(shape_yx)


def _fail(name: str, problem: str) -> NoReturn:
    raise VolprepError("VP4031", path=name, problem=problem)
