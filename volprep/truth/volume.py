"""Input of the oracles: a scalar field on a grid, and the transfer function that gives it extinction and colour."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.truth.lit import Normals
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Affine, Grid
from volprep_formats.package.transfer_function import TransferFunction


@dataclass(frozen=True)
class Volume:
    """A scalar field on a grid: physical = slope · stored + intercept, trilinear between voxel centres, or labels."""

    stored: NDArray[np.generic]
    """Stored values [z, y, x], C order: uint8, int16, uint16 or float32."""
    grid: Grid
    """Positions of the voxels."""
    slope: float = 1.0
    """physical = slope · stored + intercept."""
    intercept: float = 0.0
    """physical = slope · stored + intercept."""
    nearest: bool = False
    """Whether the field is constant in each voxel, as labels are."""
    normals: Normals = None
    """Lighting, if the volume is lit."""


@dataclass(frozen=True)
class Medium:
    """A volume and what its values look like."""

    volume: Volume
    """The values."""
    transfer_function: TransferFunction
    """Extinction and colour over physical values. At a jump the value itself belongs to the side above."""
    placed: Affine | None = None
    """Registration: matrix from the space of the volume's grid to that of the picture; None if the two are the same."""


def require_field(stored: NDArray[np.generic], grid: Grid) -> None:
    """Raise ValueError if the values do not have the grid's shape, and the errors of `require_finite`."""
    if stored.shape != grid.shape_zyx:
        msg = f"volume has shape {stored.shape}, its grid {grid.shape_zyx}"
        raise ValueError(msg)
    require_finite(stored)


def require_finite(stored: NDArray[np.generic]) -> None:
    """Raise VP6001 if a voxel is not finite: the field around it is not defined."""
    if stored.dtype.kind != "f":
        return
    # Slice by slice: a mask of the whole volume would cost a quarter of its memory again.
    for z, plane in enumerate(stored):
        wrong = np.argwhere(~np.isfinite(plane))
        if len(wrong):
            y, x = wrong[0].tolist()
            raise VolprepError("VP6001", z=z, y=y, x=x, value=plane[y, x])
