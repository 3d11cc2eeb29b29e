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
class BrickRow:
    """Bricks of a level that follow each other along x."""

    voxels: Voxels
    """Their voxels [z, y, x] with `ghost` layers of their neighbours on each side; beyond the level the outer voxels
    are repeated."""
    inner_zyx: Triple
    """Number of the level's voxels among them, without those layers."""
    size: int
    """Voxels along an edge of a brick."""
    ghost: int
    """Layers of neighbours' voxels on each side of a brick."""
    coarse: Voxels | None
    """Rows of the next coarser level around them [z, y, x]; None for the coarsest level."""
    places_zyx: tuple[Float32Array, Float32Array, Float32Array]
    """Places of the level's voxels and of one more on each side, in voxels of `coarse`, along each axis."""

    @property
    def count(self) -> int:
        """Number of bricks."""
        return -(-self.inner_zyx[2] // self.size)

    @property
    def bricks(self) -> Iterator[Voxels]:
        """The voxels of each brick."""
        for number in range(self.count):
            begin = number * self.size
            yield self.voxels[:, :, begin : begin + self.size + 2 * self.ghost]


def rows_of_bricks(
    level: RawVolume, coarser: RawVolume | None, factors_zyx: Triple, size: int, ghost: int
) -> Iterator[BrickRow]:
    """Yield the rows of bricks of a level, y first, then z.

    `factors_zyx` are the factors from this level to the next, `ghost` the layers of neighbours' voxels around a brick.
    """
    depth, height, width = level.shape_zyx
    columns = np.arange(-ghost, -(-width // size) * size + ghost)
    for z, y in product(range(0, depth, size), range(0, height, size)):
        inner_zyx = min(size, depth - z), min(size, height - y), width
        coarse, places = None, (np.empty(0, np.float32),) * 3
        if coarser is not None:
            begins = zip((z, y, 0), inner_zyx, factors_zyx, level.shape_zyx, coarser.shape_zyx, strict=True)
            found = [_places(*begin) for begin in begins]
            rows = [slice(int(at[0]), min(int(at[-1]) + 2, n)) for at, n in zip(found, coarser.shape_zyx, strict=True)]
            coarse = coarser.read_rows(rows[0], rows[1])
            firsts = (rows[0].start, rows[1].start, 0)
            z_places, y_places, x_places = (
                (at - first).astype(np.float32) for at, first in zip(found, firsts, strict=True)
            )
            places = (z_places, y_places, x_places)
        voxels = _rows(level, np.arange(z - ghost, z + size + ghost), np.arange(y - ghost, y + size + ghost))
        held = np.take(voxels, np.clip(columns, 0, width - 1), axis=2)
        yield BrickRow(held, inner_zyx, size, ghost, coarse, places)


def _rows(volume: RawVolume, z: NDArray[np.intp], y: NDArray[np.intp]) -> Voxels:
    """Read rows and slices, the outer ones repeated."""
    z, y = (np.clip(at, 0, n - 1) for at, n in zip((z, y), volume.shape_zyx, strict=False))
    rows = volume.read_rows(slice(int(z[0]), int(z[-1]) + 1), slice(int(y[0]), int(y[-1]) + 1))
    found: Voxels = rows[np.ix_(z - z[0], y - y[0])]
    return found


def _places(begin: int, inner: int, factor: int, n: int, coarser: int) -> NDArray[np.float64]:
    """Return the places in a coarser level of so many voxels along an axis and of one more on each side."""
    at = np.clip(np.arange(begin - 1, begin + inner + 1), 0, n - 1)
    return np.clip((at + 0.5) / factor - 0.5, 0, coarser - 1)
