"""Morphological opening with a disk: what is thinner than the disk is gone.

As scipy.ndimage.grey_opening with a footprint, but row by row of the disk: several times as fast for a few pixels.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array

_Pick = Callable[[Float32Array, Float32Array], Float32Array]


def disk_of(diameter: float) -> NDArray[np.bool_]:
    """Return the disk whose widest row is the diameter in pixels, rounded."""
    pixels = round(diameter)
    places = np.arange(pixels) - (pixels - 1) / 2
    disk: NDArray[np.bool_] = np.hypot(*np.meshgrid(places, places)) <= pixels / 2
    return disk


def opened(values: Float32Array, disk: NDArray[np.bool_]) -> Float32Array:
    """Return the opening of `values` [H, W], continued by reflection, with a disk that is symmetric."""
    before = (len(disk) - 1) // 2
    after = len(disk) - 1 - before
    eroded = _picked(values, disk, (before, after), np.minimum)
    return _picked(eroded, disk, (after, before), np.maximum)


def _picked(values: Float32Array, disk: NDArray[np.bool_], margins: tuple[int, int], pick: _Pick) -> Float32Array:
    """Return the least or largest value below the disk around each pixel."""
    height, width = values.shape
    wide = np.pad(values, margins, mode="symmetric")
    rows: dict[bytes, Float32Array] = {}
    found: Float32Array | None = None
    for first, row in enumerate(disk):
        if row.tobytes() not in rows:
            rows[row.tobytes()] = _along(wide, np.flatnonzero(row), width, pick)
        part = rows[row.tobytes()][first : first + height]
        found = part.copy() if found is None else pick(found, part)
    assert found is not None  # noqa: S101 - a disk has rows
    return found


def _along(wide: Float32Array, columns: NDArray[np.intp], width: int, pick: _Pick) -> Float32Array:
    found = wide[:, columns[0] : columns[0] + width]
    for column in columns[1:]:
        found = pick(found, wide[:, column : column + width])
    return found
