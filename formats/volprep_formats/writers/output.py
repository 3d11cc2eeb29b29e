"""What the writers share: a file that appears whole or not at all, and voxels in pieces."""

import gzip
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from volprep_formats.package.storage.files import output_errors
from volprep_formats.progress import Progress
from volprep_formats.source import VolumeSource


@contextmanager
def new_file(path: Path) -> Iterator[BinaryIO]:
    """Return a file that takes the name `path` when the block ends well. Raises VP4020 where it cannot be written."""
    with output_errors(path):
        descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".partial", dir=path.parent)
        try:
            with os.fdopen(descriptor, "wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            Path(name).chmod(0o644)
            Path(name).replace(path)
        except BaseException:
            with suppress(OSError):
                Path(name).unlink()
            raise


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
