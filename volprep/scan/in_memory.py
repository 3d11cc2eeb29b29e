"""Volumes in memory, where a file of voxels is expected."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.scan.slabs import RawVolume


@dataclass(frozen=True)
class InMemory(RawVolume):
    """Voxels that are no file."""

    voxels: NDArray[np.generic]
    """[z, y, x]."""

    @classmethod
    def of(cls, voxels: NDArray[np.generic]) -> "InMemory":
        """Return a volume of these voxels."""
        z, y, x = voxels.shape
        return cls(Path(), (z, y, x), voxels.dtype, voxels)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return slices z0 to z1 - 1, not as a copy."""
        return self.voxels[z0:z1]

    def read_rows(self, z: slice, y: slice) -> NDArray[np.generic]:
        """Return rows `y` of the slices `z`, not as a copy unless rows must follow each other."""
        return np.ascontiguousarray(self.voxels[z, y])
