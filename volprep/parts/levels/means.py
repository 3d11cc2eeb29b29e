"""Input of fitted levels: cells of level 0, and means over parts of them.

Where a voxel of a level covers thousands of voxels of level 0, its means are a small part of level 0. One pass over
level 0 stores the means of all such levels on disk, and these levels are made from them alone.
"""

import math
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.appearance import Look, largest_code, write_means
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.arrays import Float32Array

Factors = tuple[int, int, int]

_SAMPLES = 4
"""Along each axis of a voxel of the level. If it covers more voxels of level 0, their means are the samples: less work
for each level below the second, and light as close (a head at an eighth: within 0.7 %; with two samples, 4 %)."""
_LEAST_KEPT = 4**3
"""Voxels in a mean that is kept on the disk: a mean and its look take 20 bytes."""


def edges_of_means(factors_zyx: Factors) -> Factors:
    """Return the voxels of level 0 along the edges of a mean."""
    z, y, x = (max(1, factor // _SAMPLES) for factor in factors_zyx)
    return z, y, x


def are_kept(factors_zyx: Factors) -> bool:
    """Whether a level is so far down that its means can be kept on the disk."""
    return math.prod(edges_of_means(factors_zyx)) >= _LEAST_KEPT


@dataclass(frozen=True)
class Cells:
    """Codes of level 0 in the cells of some slices of a level: their means, where fits begin, and the range of each."""

    box: NDArray[Any]
    low: NDArray[Any]
    high: NDArray[Any]

    @classmethod
    def empty(cls, shape_zyx: Factors, dtype: np.dtype[np.generic]) -> Self:
        """Return memory for them."""
        return cls(*(np.empty(shape_zyx, dtype) for _ in range(3)))

    @classmethod
    def of(cls, slab: NDArray[Any], factors_zyx: Factors) -> Self:
        """Return the cells of a slab."""
        cells = cls.empty(_native.box_reduced_shape(slab.shape, factors_zyx), slab.dtype)
        cells.fill(slab, factors_zyx)
        return cells

    def fill(self, slab: NDArray[Any], factors_zyx: Factors) -> None:
        """Write what the cells of a slab are."""
        _native.box_reduce(slab, self.box, factors_zyx)
        _native.extrema_reduce(slab, self.low, self.high, factors_zyx)

    def begin(self, bins_per_code: float) -> Float32Array:
        """Return the values where a fit begins, in bins."""
        level: Float32Array = np.multiply(self.box, np.float32(bins_per_code), dtype=np.float32)
        return level

    def codes(self, level: Float32Array, bins_per_code: float) -> NDArray[Any]:
        """Return the codes of a fitted level, each in the range of its cell; overwrites `level`."""
        level /= np.float32(bins_per_code)
        codes: NDArray[Any] = np.rint(level, out=level).astype(self.box.dtype)
        np.clip(codes, self.low, self.high, out=codes)
        return codes

    def __getitem__(self, part: slice) -> "Cells":
        """Return some of its slices."""
        return Cells(self.box[part], self.low[part], self.high[part])


@dataclass(frozen=True)
class Strip:
    """Some slices of a level: its cells, and the means that it is fitted to."""

    values: Float32Array
    """In bins [z, y, x]."""
    looks: Float32Array
    """[z, function, y, x, 4]."""
    cells: Cells

    @classmethod
    def empty(cls, slab_zyx: Factors, factors_zyx: Factors, look: Look, dtype: np.dtype[np.generic]) -> Self:
        """Return memory for the means of a slab of this shape."""
        z, y, x = _native.box_reduced_shape(slab_zyx, edges_of_means(factors_zyx))
        looks = np.empty((z, len(look.table), y, x, look.table.shape[2]), np.float32)
        cells = Cells.empty(_native.box_reduced_shape(slab_zyx, factors_zyx), dtype)
        return cls(np.empty((z, y, x), np.float32), looks, cells)

    def fill(self, slab: NDArray[Any], factors_zyx: Factors, look: Look) -> None:
        """Write what a slab of level 0 makes of them: whole cells, but for the last of a volume."""
        write_means(slab, edges_of_means(factors_zyx), look.table, self.values, self.looks)
        self.cells.fill(slab, factors_zyx)

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """Return all that it consists of: means first, then what cells have."""
        return self.values, self.looks, self.cells.box, self.cells.low, self.cells.high

    def part(self, samples: slice, cells: slice) -> "Strip":
        """Return some slices of means, and the slices of cells that they are of."""
        return Strip(self.values[samples], self.looks[samples], self.cells[cells])


class Means(Protocol):
    """Where the means of a level come from."""

    def read(self, begin: int, strip: Strip) -> None:
        """Fill a strip, whose first slice of cells has the number `begin` in the level."""


@dataclass(frozen=True)
class MeansOfVoxels:
    """Means that are made whenever they are read."""

    volume: RawVolume
    factors_zyx: Factors
    look: Look

    def read(self, begin: int, strip: Strip) -> None:
        """Fill a strip from level 0, some slices of cells at a time: one may be many slices of level 0."""
        factor, edge = self.factors_zyx[0], edges_of_means(self.factors_zyx)[0]
        start = begin * factor
        stop = min(start + len(strip.cells.box) * factor, self.volume.shape_zyx[0])
        for z0, z1 in slab_ranges(stop - start, self.volume.slice_bytes, multiple=factor):
            samples, cells = (slice(z0 // n, -(-z1 // n)) for n in (edge, factor))
            slab = self.volume.read_slab(start + z0, start + z1)
            strip.part(samples, cells).fill(slab, self.factors_zyx, self.look)


@dataclass(frozen=True)
class KeptMeans:
    """Means on the disk."""

    values: RawVolume
    looks: RawVolume
    """The rows of all functions follow each other."""
    box: RawVolume
    low: RawVolume
    high: RawVolume
    samples: int
    """Along z of a cell."""

    @classmethod
    def planned(cls, volume: RawVolume, factors_zyx: Factors, look: Look, scratch: Callable[[str], Path]) -> Self:
        """Return where the means of a level are stored."""
        name = "-".join(map(str, factors_zyx))
        edges = edges_of_means(factors_zyx)
        z, y, x = _native.box_reduced_shape(volume.shape_zyx, edges)
        looks = (z, len(look.table) * y, look.table.shape[2] * x)
        cells = _native.box_reduced_shape(volume.shape_zyx, factors_zyx)
        real = np.dtype(np.float32)
        box, low, high = (
            RawVolume(scratch(f"{name}-{value}.raw"), cells, volume.dtype) for value in ("box", "low", "high")
        )
        return cls(
            RawVolume(scratch(f"{name}-values.raw"), (z, y, x), real),
            RawVolume(scratch(f"{name}-looks.raw"), looks, real),
            box,
            low,
            high,
            factors_zyx[0] // edges[0],
        )

    @property
    def files(self) -> tuple[RawVolume, ...]:
        """Return the stored arrays, in the order of `Strip.arrays`."""
        return self.values, self.looks, self.box, self.low, self.high

    def read(self, begin: int, strip: Strip) -> None:
        """Fill a strip from the disk; it may have no looks."""
        for file, part in zip(self.files, strip.arrays, strict=True):
            if part.size:
                first = begin * (self.samples if file in (self.values, self.looks) else 1)
                part[...] = file.read_slab(first, first + len(part)).reshape(part.shape)


def keep_means(
    volume: RawVolume, looks: Mapping[Factors, Look], scratch: Callable[[str], Path], advance: Callable[[int], None]
) -> dict[Factors, KeptMeans]:
    """Keep the means of levels in scratch files, by their factors, whose looks are given. One pass over level 0."""
    kept = {factors: KeptMeans.planned(volume, factors, look, scratch) for factors, look in looks.items()}
    with ExitStack() as stack:
        files = {
            factors: [stack.enter_context(file.writing()) for file in means.files] for factors, means in kept.items()
        }
        whole_cells = max(factors[0] for factors in looks)
        for z0, z1 in slab_ranges(volume.shape_zyx[0], volume.slice_bytes, multiple=whole_cells):
            slab: NDArray[Any] = volume.read_slab(z0, z1)
            for factors, look in looks.items():
                strip = Strip.empty(slab.shape, factors, look, slab.dtype)
                strip.fill(slab, factors, look)
                for append, part in zip(files[factors], strip.arrays, strict=True):
                    if part.size:
                        append(part)
            advance(z1 - z0)
    return kept


def bins_per_code(look: Look, dtype: np.dtype[np.generic]) -> float:
    """Return the bins of a look for each code."""
    return (look.bins - 1) / largest_code(dtype)
