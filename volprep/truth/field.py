"""Colour and extinction at single positions, in double precision: for slow twins of the shaders."""

import numpy as np
from numpy.typing import NDArray

from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table


def medium_at(medium: Medium, at_mm: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return colour [n, 3] and extinction per millimetre [n] of the trilinear field at box positions [n, 3]."""
    volume = medium.volume
    at = at_mm / volume.grid.spacing_mm_zyx[::-1]
    values = volume.slope * _trilinear(volume.stored, at) + volume.intercept
    return Table.exact(medium.transfer_function).at(values)


def _trilinear(volume: NDArray[np.generic], at_xyz: Float64Array) -> Float64Array:
    """Return stored values at positions in voxels, whose centres are at halves."""
    last = np.array(volume.shape) - 1
    at = np.clip(at_xyz[:, ::-1] - 0.5, 0.0, last)
    lower = np.minimum(at.astype(np.intp), np.maximum(last - 1, 0))
    upper, share = np.minimum(lower + 1, last), at - lower
    values = np.zeros(len(at))
    for corner in range(8):
        chosen = np.array([corner >> 2 & 1, corner >> 1 & 1, corner & 1], bool)
        z, y, x = np.where(chosen, upper, lower).T
        values += np.prod(np.where(chosen, share, 1.0 - share), axis=1) * volume[z, y, x]
    return values
