"""Volumes slab by slab: memory does not grow with their depth."""

import math
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.output import output_errors
from volprep_formats.package.storage.chunks import write_all

SLAB_BYTES = 32 * 1024 * 1024
"""Size that a slab aims at. Doubling it made no stage faster; a slab always holds at least one slice."""


def slab_ranges(
    depth: int, slice_bytes: int, multiple: int = 1, slab_bytes: int | None = None
) -> Iterator[tuple[int, int]]:
    """Cut `depth` slices into ranges (z0, z1) that follow each other; all but the last are a multiple of `multiple`.

    Each aims at `slab_bytes`, which is SLAB_BYTES if not given.
    """
    thickness = max(1, (slab_bytes or SLAB_BYTES) // (slice_bytes * multiple)) * multiple
    for z0 in range(0, depth, thickness):
        yield z0, min(z0 + thickness, depth)


@dataclass(frozen=True)
class RawVolume:
    """A file of voxels in C order, little-endian, without a header: the working data of a draft."""

    path: Path
    """The file."""
    shape_zyx: tuple[int, int, int]
    """Number of voxels along each axis."""
    dtype: np.dtype[np.generic]
    """Type of a voxel."""

    @property
    def slice_bytes(self) -> int:
        """Size of one slice."""
        return self.shape_zyx[1] * self.shape_zyx[2] * self.dtype.itemsize

    @property
    def size_bytes(self) -> int:
        """Size of the file."""
        return self.shape_zyx[0] * self.slice_bytes

    @contextmanager
    def writing(self) -> Iterator[Callable[[NDArray[np.generic]], None]]:
        """Create the file and return a function that appends slices. Raises VP4020 if it cannot be written."""
        with output_errors(self.path, needed_bytes=self.size_bytes):
            file = self.path.open("wb", buffering=0)

        def append(voxels: NDArray[np.generic]) -> None:
            with output_errors(self.path, needed_bytes=self.size_bytes):
                write_all(file, bytes_of(voxels))

        with file:
            yield append

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Read slices z0 to z1 - 1 as [z, y, x].

        With plain reads: pages of a memory map would count as the process's own memory. The disk reads the same number
        of slices ahead while these are used: a pass over a volume that is not in memory takes half of the time.
        """
        shape = (z1 - z0, *self.shape_zyx[1:])
        stored = self.dtype.newbyteorder("<")
        with self.path.open("rb", buffering=0) as file:
            voxels = np.fromfile(file, stored, int(np.prod(shape)), offset=z0 * self.slice_bytes)
            if hasattr(os, "posix_fadvise"):
                size = (z1 - z0) * self.slice_bytes
                os.posix_fadvise(file.fileno(), z1 * self.slice_bytes, size, os.POSIX_FADV_WILLNEED)
        return voxels.reshape(shape).astype(self.dtype, copy=False)

    def read_rows(self, z: slice, y: slice) -> NDArray[np.generic]:
        """Read rows `y` of the slices `z` as [z, y, x]."""
        row_bytes = self.shape_zyx[2] * self.dtype.itemsize
        rows = y.stop - y.start
        voxels = np.empty((z.stop - z.start, rows, self.shape_zyx[2]), self.dtype)
        with self.path.open("rb", buffering=0) as file:
            for plane, k in zip(voxels, range(z.start, z.stop), strict=True):
                file.seek(k * self.slice_bytes + y.start * row_bytes)
                file.readinto(plane.data.cast("B"))
        return voxels


def bytes_of(array: NDArray[np.generic]) -> memoryview:
    """Return the bytes of an array in C order, little-endian, without a copy where it is that already."""
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<")).data.cast("B")


@contextmanager
def temporary_codes(folder: Path, shape: tuple[int, ...]) -> Iterator[NDArray[np.uint16]]:
    """Return zeros in a nameless file in `folder`, which goes with the block. Raises VP4020 if it finds no room."""
    size_bytes = math.prod(shape) * np.dtype(np.uint16).itemsize
    with output_errors(folder, needed_bytes=size_bytes):
        file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - it is closed below
    with file:
        with output_errors(folder, needed_bytes=size_bytes):
            # A map of a file with holes ends the process with a signal when the disk is full.
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size_bytes)
            codes: NDArray[np.uint16] = np.memmap(file, np.uint16, "w+", shape=shape)
        yield codes
