"""A scan as an independent library reads it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class CannotWitnessError(Exception):
    """Something that this package cannot read or draw; the message is the reason, in one line."""


@dataclass(frozen=True)
class WitnessedScan:
    """Voxels and where they are."""

    stored: NDArray[Any]
    """Values as the library returns them, [z, y, x]."""
    slope: float
    """physical = slope · stored + intercept."""
    intercept: float
    """physical = slope · stored + intercept."""
    world_from_index: Floats
    """4×4 matrix from (x, y, z, 1) in voxels to millimetres in the patient's space (LPS)."""
    library: str
    """Library that read it, with the version."""

    @property
    def counts_xyz(self) -> Floats:
        """Number of voxels along x, y and z."""
        return np.array(self.stored.shape[::-1], dtype=np.float64)

    def physical(self, stored: NDArray[Any]) -> Floats:
        """Return physical values of stored ones."""
        return self.slope * np.asarray(stored, dtype=np.float64) + self.intercept

    def index_of(self, world_mm: Floats) -> Floats:
        """Return places [..., xyz] in voxels, the centre of the first at 0."""
        inverse = np.linalg.inv(self.world_from_index)
        place: Floats = world_mm @ inverse[:3, :3].T + inverse[:3, 3]
        return place


def affine(axes_mm_xyz: Floats, origin_mm: Floats) -> Floats:
    """Return the 4×4 matrix whose columns are steps of one voxel along x, y and z, and the centre of the first."""
    matrix = np.eye(4)
    matrix[:3, :3] = axes_mm_xyz
    matrix[:3, 3] = origin_mm
    return matrix


def between_eight(voxels: NDArray[Any], place: Floats) -> Floats:
    """Interpolate [z, y, x] or [z, y, x, component] at places [..., xyz] in voxels within the array."""
    last = np.array(voxels.shape[2::-1]) - 1
    low = np.minimum(place.astype(np.intp), np.maximum(last - 1, 0))
    share = place - low
    result: Any = 0.0
    for corner in np.ndindex(2, 2, 2):
        upper = np.array(corner)
        x, y, z = np.moveaxis(np.minimum(low + upper, last), -1, 0)
        weight = np.prod(np.where(upper, share, 1.0 - share), axis=-1)
        found = voxels[z, y, x].astype(np.float64)
        result = result + (weight[..., None] if found.ndim > weight.ndim else weight) * found
    return np.asarray(result)
