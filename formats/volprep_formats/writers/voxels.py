"""Helpers of the writers: voxels in pieces, and gzip without a timestamp."""

import gzip
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, cast

import numpy as np

from volprep_formats.progress import Progress
from volprep_formats.source import VolumeSource


@contextmanager
def zipped(file: BinaryIO) -> Iterator[BinaryIO]:
    """Return a gzip stream into `file`, without name and time: the same bytes for the same volume."""
    with gzip.GzipFile(filename="", mode="wb", compresslevel=6, fileobj=file, mtime=0) as stream:
        yield cast("BinaryIO", stream)


def write_voxels(source: VolumeSource, file: BinaryIO, progress: Progress) -> None:
    """Write the stored values, little-endian, slice by slice."""
    depth = source.info.grid.shape_zyx[0]
    progress.start("writing voxels", depth)
    dtype = np.dtype(source.info.stored_type).newbyteorder("<")
    for z in range(depth):
        file.write(np.ascontiguousarray(source.read_slab(z, z + 1), dtype=dtype).tobytes())
        progress.advance()
