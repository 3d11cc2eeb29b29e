"""The volume to read, of several that lie beside each other at each voxel, or behind each other in a file."""

from dataclasses import dataclass
from math import prod
from pathlib import Path

import numpy as np

from volprep_formats.readers.unpacking import Stream
from volprep_formats.readers.voxel_file import VoxelFile


@dataclass(frozen=True)
class VolumeLayout:
    """Shape of a volume, how many there are, and the one to read."""

    shape_zyx: tuple[int, int, int]
    beside: int = 1
    """Number of values at each voxel."""
    behind: int = 1
    """Number of volumes behind each other; 1 if there are several beside each other."""
    wanted: int = 0
    """Index of the volume to read."""

    def voxel_bytes(self, dtype: np.dtype[np.generic]) -> int:
        """Size of all volumes."""
        return prod(self.shape_zyx) * self.beside * self.behind * dtype.itemsize

    def opened(
        self, file: Path, dtype: np.dtype[np.generic], start_bytes: int, stream: Stream | None = None
    ) -> VoxelFile:
        """Return the voxels of the volume; the first one begins at `start_bytes` of `stream`, or of the file."""
        if self.beside > 1:
            return VoxelFile(file, dtype, self.shape_zyx, start_bytes, stream, values=self.beside, value=self.wanted)
        before = self.wanted * prod(self.shape_zyx) * dtype.itemsize
        return VoxelFile(file, dtype, self.shape_zyx, start_bytes + before, stream)

    @property
    def most_bytes_after(self) -> int | None:
        """Number of bytes that may follow the volume: none after the last one, else any."""
        return 0 if self.beside > 1 or self.wanted == self.behind - 1 else None
