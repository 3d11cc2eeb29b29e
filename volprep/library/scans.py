"""Read scans: list the contents of a folder, and load voxels as an array."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from volprep.library.choices import SourceChoices, source_of
from volprep.scan.channels import opened_channel
from volprep.scan.slabs import slab_ranges
from volprep_formats.arrays import Float32Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Progress, Silent
from volprep_formats.readers import channels_of
from volprep_formats.readers.dicom.listing import Listing
from volprep_formats.readers.dicom.listing import list_series as series_below
from volprep_formats.readers.volpkg import open_level
from volprep_formats.source import SourceInfo, VolumeSource


@dataclass(frozen=True)
class VoxelArray:
    """A volume in memory."""

    stored: NDArray[np.generic]
    """Voxels [z, y, x] as they are stored, of type `info.stored_type`."""
    info: SourceInfo
    """Grid, type, unit, modality, and the mapping of stored values to physical ones."""

    def __repr__(self) -> str:
        """Describe the volume on one line: a notebook shows it for each scan that is read."""
        shape, spacing = self.stored.shape, self.grid.spacing_mm_zyx
        zyx = " × ".join(map(str, shape)), " × ".join(f"{value:.6g}" for value in spacing)
        return f"<VoxelArray [z, y, x] of {zyx[0]} voxels of {zyx[1]} mm, {self.stored.dtype}>"

    @property
    def grid(self) -> Grid:
        """Position of the voxels in the patient's space, in millimetres."""
        return self.info.grid

    @property
    def physical(self) -> Float32Array:
        """Physical values [z, y, x], such as Hounsfield units; float32, a new array each time."""
        exact = self.stored.astype(np.float64) * self.info.slope + self.info.intercept
        values: Float32Array = exact.astype(np.float32)
        return values


def read_scan(
    path: str | PathLike[str], progress: Progress | None = None, **choices: Unpack[SourceChoices]
) -> VoxelArray:
    """Read a scan into memory, at full precision.

    Parameters
    ----------
    path
        File or folder of any format that volprep reads.
    progress
        Progress callback, or None.
    choices
        Part of the source to read, with the keys of [source] in a scene: `series`, `volume`, `channel`, `level`,
        `repair`, `rgb`, `labels`, `mask`, `raw` and so on.

    Raises
    ------
    VolprepError
        VP9010 for a choice that a source cannot have, VP1xxx and VP2xxx for a scan that cannot be read.
    """
    watcher = progress or Silent()
    with opened_channel(source_of(Path(path), choices), watcher) as source:
        return _in_memory(source, watcher)


def read_level(package: str | PathLike[str], level: int | None = None, channel: str | int | None = None) -> VoxelArray:
    """Read a level of a package into memory: the finest one and the first channel, if neither is given.

    The values are returned as the package holds them, after quantization. Raises VP1221, VP1222, VP1250 and VP1253 for
    a part that the package does not have, VP40xx for an unsound package.
    """
    with open_level(Path(package), level, channel) as source:
        return _in_memory(source, Silent())


def list_series(folder: str | PathLike[str], progress: Progress | None = None) -> Listing:
    """List the DICOM series in a folder tree, with all faults of each.

    No description is read: that is free text, which may name a patient. Raises VP1001, VP1003 and VP1030 for a folder
    that is missing, unreadable or without DICOM.
    """
    return series_below(Path(folder), progress or Silent())


def list_channels(path: str | PathLike[str]) -> list[str]:
    """Return the names of the channels of a file or package, "" for one without a name. Raises VP1001 to VP1003."""
    return channels_of(Path(path))


def _in_memory(source: VolumeSource, progress: Progress) -> VoxelArray:
    info = source.info
    shape, stored = info.grid.shape_zyx, np.dtype(info.stored_type)
    try:
        voxels = np.empty(shape, stored)
    except MemoryError as error:
        raise VolprepError("VP9011", size=int(np.prod(shape, dtype=np.int64)) * stored.itemsize) from error
    progress.start("read", shape[0])
    for z0, z1 in slab_ranges(shape[0], shape[1] * shape[2] * stored.itemsize):
        voxels[z0:z1] = source.read_slab(z0, z1)
        progress.advance(z1 - z0)
    return VoxelArray(voxels, info)
