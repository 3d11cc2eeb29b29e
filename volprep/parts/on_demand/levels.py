"""Rows of bricks of a level, with the next coarser level at the same voxels."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float32Array

Triple = tuple[int, int, int]
Voxels = NDArray[np.generic]


@dataclass(frozen=True)
class Brick:
    """A brick of a level."""

    texels: Voxels
    """Its voxels and the voxels of its neighbours, [z, y, x]; beyond the level the outer ones are repeated."""
    around: Voxels
    """Those of its voxels that the level has, with one layer more on each side: rays between the outermost voxels and
    the face see half of it."""
    coarse: Float32Array | None
    """The next level at the places of `around`; None for the coarsest level."""


def bricks_of(
    level: RawVolume, coarser: RawVolume | None, factors_zyx: Triple, size: int, ghost: int
) -> Iterator[Brick]:
    """Yield the bricks of a level, x first, then y, then z.

    A row of bricks is read at a time. `factors_zyx` are the factors from this level to the next, `ghost` the layers of
    neighbours' voxels on each side of a brick.
    """
    nz, ny, nx = level.shape_zyx
    for z, y in product(range(0, nz, size), range(0, ny, size)):
        row = _rows(level, np.arange(z - ghost, z + size + ghost), np.arange(y - ghost, y + size + ghost))
        inner_z, inner_y = min(size, nz - z), min(size, ny - y)
        between = None
        if coarser is not None:
            ranges = ((z - 1, z + inner_z + 1, nz), (y - 1, y + inner_y + 1, ny), (0, nx, nx))
            places = tuple(np.clip(np.arange(first, end), 0, n - 1) for first, end, n in ranges)
            between = _between(coarser, places, factors_zyx)
        for x in range(0, nx, size):
            held = np.clip(np.arange(x - ghost, x + size + ghost), 0, nx - 1)
            texels = row[:, :, held]
            first, end = ghost - 1, ghost + min(size, nx - x) + 1
            yield Brick(
                texels=texels,
                around=texels[first : first + inner_z + 2, first : first + inner_y + 2, first:end],
                coarse=None if between is None else between[:, :, held[first:end]],
            )


def _rows(volume: RawVolume, z: NDArray[np.intp], y: NDArray[np.intp]) -> Voxels:
    """Read rows and slices, the outer ones repeated."""
    z, y = (np.clip(at, 0, n - 1) for at, n in zip((z, y), volume.shape_zyx, strict=False))
    rows = volume.read_rows(slice(int(z[0]), int(z[-1]) + 1), slice(int(y[0]), int(y[-1]) + 1))
    found: Voxels = rows[np.ix_(z - z[0], y - y[0])]
    return found


def _between(coarser: RawVolume, places: tuple[NDArray[np.intp], ...], factors_zyx: Triple) -> Float32Array:
    """Return the trilinear field of a coarser level at the centres of voxels."""
    low, weights = [], []
    for at, factor, n in zip(places, factors_zyx, coarser.shape_zyx, strict=True):
        position = np.clip((at + 0.5) / factor - 0.5, 0, n - 1)
        low.append(np.floor(position).astype(np.intp))
        weights.append((position - low[-1]).astype(np.float32))
    ends = [np.minimum(each[-1] + 1, n - 1) for each, n in zip(low, coarser.shape_zyx, strict=True)]
    field = coarser.read_rows(slice(int(low[0][0]), int(ends[0]) + 1), slice(int(low[1][0]), int(ends[1]) + 1)).astype(
        np.float32
    )
    for axis, (at, weight) in enumerate(zip(low, weights, strict=True)):
        first = at - (at[0] if axis < 2 else 0)
        second = np.minimum(first + 1, field.shape[axis] - 1)
        share = weight.reshape([-1 if k == axis else 1 for k in range(3)])
        field = np.take(field, first, axis) * (1 - share) + np.take(field, second, axis) * share
    return field
