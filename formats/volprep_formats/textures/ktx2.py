"""KTX 2 textures as packages have them: one level, 2D or 3D, not compressed (Khronos KTX 2.0 specification).

All numbers are little-endian. The file is: header and index (80 bytes), one level index entry (24), the data format
descriptor of the Khronos Data Format Specification 1.3 (a basic block), two key/value entries, padding, texels.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Ktx2Format = Literal["R8", "RGBA8", "R16", "R16F", "RGBA16F"]


@dataclass(frozen=True)
class Ktx2Image:
    """One texture. `data` is [z, y, x] for one channel, [z, y, x, 4] for four, in C order."""

    format: Ktx2Format
    """R8 and RGBA8: uint8; R16: uint16; R16F and RGBA16F: float16."""
    shape_zyx: tuple[int, int, int]
    """Depth, height and width in texels; depth is 1 for a 2D texture."""
    data: NDArray[np.generic]
    """Texels; row 0 is at texture coordinate t = 0, slice 0 at r = 0."""
    dimensions: Literal[2, 3]
    """2 for TEXTURE_2D, 3 for TEXTURE_3D, also where its depth is 1."""


def header(texture_format: Ktx2Format, shape_zyx: tuple[int, int, int], dimensions: Literal[2, 3]) -> bytes:
    """Make everything that stands before the texels, to write a texture whose texels come in pieces."""
    raise NotImplementedError


def encode(image: Ktx2Image) -> Iterator[bytes | memoryview]:
    """Give the file in pieces: the header, then the texels slice by slice, not copied where they are in order."""
    raise NotImplementedError


def decode(data: bytes, name: str) -> Ktx2Image:
    """Read a texture; `name` is for messages. `data` of the image is a view. Raises VP4030."""
    raise NotImplementedError
