"""Writes a volume as an OpenVDB fog volume, the same bytes for the same volume.

OpenVDB puts a random identifier (UUID) into every file, bytes 21 to 56; here it is made of the digest of all the rest.
"""

import hashlib
import os
import struct
from pathlib import Path
from uuid import UUID

import numpy as np

from volprep_formats.output import new_path, require_place
from volprep_formats.progress import Progress
from volprep_formats.readers.vdb.tree import openvdb
from volprep_formats.source import VolumeSource
from volprep_formats.writers.values import PhysicalValues

_SLAB_BYTES = 2**26
_LEAF = 8
_UUID_AT, _UUID_BYTES = 21, 36
_NO_METADATA_ONE_GRID = 8
_TEXTS_OF_A_GRID = 3
"""Name, type and parent, each after its length; then the offsets of the grid, its blocks and its end."""


def write(source: VolumeSource, path: Path, progress: Progress) -> None:
    """Write the physical values of `source` as the grid "density" of 32-bit floats; an older file is replaced.

    Voxels of value 0 are the background and take no space, but the first and the last voxel are active whatever their
    value, so that the bounding box of the active voxels is the whole volume. World is LPS in millimetres. Raises
    VolprepError VP1081 (cannot be written), VP1201 (OpenVDB is not installed) and the errors of reading.
    """
    require_place(path, "VP1081")
    grid, values = source.info.grid, PhysicalValues(source)
    nz, ny, nx = grid.shape_zyx
    fog = openvdb(path).FogVolume("density", grid.world_from_index.tolist())
    step = max(_LEAF, _SLAB_BYTES // (4 * ny * nx) // _LEAF * _LEAF)
    progress.start("making the volume sparse", nz)
    for z0 in range(0, nz, step):
        z1 = min(z0 + step, nz)
        fog.add(z0, np.ascontiguousarray(values.read_slab(z0, z1), np.float32))
        progress.advance(z1 - z0)
    fog.activate((0, 0, 0))
    fog.activate((nx - 1, ny - 1, nz - 1))
    with new_path(path, "VP1081") as unfinished:
        try:
            fog.write(str(unfinished))
        except RuntimeError as error:
            raise OSError(str(error)) from error
        _require_whole(unfinished)
        _name_by_content(unfinished)


def _require_whole(path: Path) -> None:
    """Raise OSError if the file does not end where its only grid ends, by its own header.

    OpenVDB does not check its writes: a full disk gave a truncated file, and no error.
    """
    with path.open("rb") as file:
        file.seek(_UUID_AT + _UUID_BYTES)
        file.read(_NO_METADATA_ONE_GRID)
        for _ in range(_TEXTS_OF_A_GRID):
            file.seek(int.from_bytes(file.read(4), "little"), os.SEEK_CUR)
        _, _, end = struct.unpack("<3q", file.read(24).ljust(24, b"\0"))
        size = file.seek(0, os.SEEK_END)
    if size != end:
        raise OSError(f"{size} bytes of {max(end, 0) or 'more'} were written; the disk may be full")


def _name_by_content(path: Path) -> None:
    """Replace the random identifier."""
    with path.open("r+b") as file:
        file.seek(_UUID_AT)
        file.write(bytes(_UUID_BYTES))
        file.seek(0)
        digest = hashlib.file_digest(file, "sha256").digest()
        file.seek(_UUID_AT)
        file.write(str(UUID(bytes=digest[:16], version=5)).encode())
