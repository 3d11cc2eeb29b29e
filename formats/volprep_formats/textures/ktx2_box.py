"""A box of texels out of a KTX 2 file: only these texels are read, in as few reads as their places allow."""

import math
import os

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.textures.ktx2 import decode_head

HEAD_BYTES = 4096
"""Bytes read to find the texels; larger than the header of any format in packages."""

Box = tuple[slice, slice, slice]


class Ktx2Box:
    """An open texture file, not compressed. It counts the bytes it reads, so that tests can check how few they are."""

    def __init__(self, descriptor: int, start_bytes: int, size_bytes: int, name: str) -> None:
        """Read the header of the texture in this part of an open file.

        Raises VP4030 if it is no texture, or supercompressed.
        """
        self._descriptor = descriptor
        self._start_bytes = start_bytes
        self._name = name
        self.reads = 1
        """Calls of the system that have read something, the head included."""
        self.texel_bytes_read = 0
        """Bytes of texels that were read."""
        head = os.pread(descriptor, min(HEAD_BYTES, size_bytes), start_bytes)
        self.head = decode_head(head, size_bytes, name)
        if self.head.supercompressed:
            raise VolprepError("VP4030", name=name, problem="it is supercompressed, so that no part can be read alone")

    def box(self, box: Box, channels: int = 1) -> NDArray[np.generic]:
        """Read the texels of a box, [z, y, x] or [z, y, x, channel].

        One read where the texels lie together: for the whole box, for each slice, or for each row. Raises VP4030 if
        the texture has another number of channels.
        """
        if self.head.channels != channels:
            problem = f"it has {self.head.channels} channels instead of {channels}"
            raise VolprepError("VP4030", name=self._name, problem=problem)
        _, height, width = self.head.shape_zyx
        z, y, x = box
        rows, columns = y.stop - y.start, x.stop - x.start
        whole_rows, whole_slices = columns == width, columns == width and rows == height
        if whole_slices:
            runs = [(z.start, 0, (z.stop - z.start) * rows * columns)]
        elif whole_rows:
            runs = [(k, y.start, rows * columns) for k in range(z.start, z.stop)]
        else:
            runs = [(k, j, columns) for k in range(z.start, z.stop) for j in range(y.start, y.stop)]
        shape = (z.stop - z.start, rows, columns, self.head.channels)
        texels = np.empty(math.prod(shape), self.head.dtype)
        target, done = texels.data.cast("B"), 0
        texel_bytes = self.head.channels * self.head.dtype.itemsize
        for k, j, count in runs:
            at = (k * height + j) * width + (0 if whole_rows else x.start)
            size = count * texel_bytes
            self._read_into(target[done : done + size], self.head.levels_at[0] + at * texel_bytes)
            done += size
        return texels.reshape(shape[:3] if self.head.channels == 1 else shape)

    def texels(self) -> NDArray[np.generic]:
        """Read a whole 2D texture, [y, x] or [y, x, channel]: the slices of a box lie all over a mosaic."""
        _, height, width = self.head.shape_zyx
        shape = (height, width) if self.head.channels == 1 else (height, width, self.head.channels)
        texels = np.empty(shape, self.head.dtype)
        self._read_into(texels.data.cast("B"), self.head.levels_at[0])
        return texels

    def _read_into(self, target: memoryview, offset: int) -> None:
        found = 0
        while found < len(target):
            count = os.preadv(self._descriptor, [target[found:]], self._start_bytes + offset + found)
            if count == 0:
                raise VolprepError("VP4030", name=self._name, problem=f"it ends at {offset + found} bytes")
            self.reads += 1
            found += count
        self.texel_bytes_read += found
