"""Writes a volume as an OpenVDB fog volume, the same bytes for the same volume.

OpenVDB puts a random identifier (UUID) into every file, bytes 21 to 56; here it is made of the digest of all the rest.
"""

import hashlib
from pathlib import Path
from uuid import UUID

import numpy as np

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Progress
from volprep_formats.readers.vdb.tree import openvdb
from volprep_formats.source import VolumeSource
from volprep_formats.writers.values import PhysicalValues

_SLAB_BYTES = 2**26
_LEAF = 8
_UUID_AT, _UUID_BYTES = 21, 36


def write(source: VolumeSource, path: Path, progress: Progress) -> None:
    """Write the physical values of `source` as the grid "density" of 32-bit floats; an older file is replaced.

    Voxels of value 0 are the background and take no room, but the first and the last voxel are active whatever their
    value: so the bounding box of the active voxels is the volume, and whoever reads it gets all of it. World is
    LPS in millimetres. Raises VolprepError VP1081 (cannot be written), VP1201 (no OpenVDB) and what reading raises.
    """
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
    unfinished = path.with_name(f".{path.name}.partial")
    try:
        fog.write(str(unfinished))
        _name_by_content(unfinished)
        unfinished.replace(path)
    except (OSError, RuntimeError) as error:
        unfinished.unlink(missing_ok=True)
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise VolprepError("VP1081", path=path, error=reason) from error


def _name_by_content(path: Path) -> None:
    """Replace the random identifier."""
    with path.open("r+b") as file:
        file.seek(_UUID_AT)
        file.write(bytes(_UUID_BYTES))
        file.seek(0)
        digest = hashlib.file_digest(file, "sha256").digest()
        file.seek(_UUID_AT)
        file.write(str(UUID(bytes=digest[:16], version=5)).encode())
