"""A level as a filter makes it of codes of level 0, which are seen through transfer functions."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.appearance import Look, Looks, bins_of, plain_look
from volprep.parts.levels.fitted import fitted_slabs
from volprep.parts.levels.means import KeptMeans
from volprep.parts.levels.noise import noise_of
from volprep.parts.levels.reduce import reduced_slabs
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter

Slices = Iterator[tuple[NDArray[Any], int]]
Factors = tuple[int, int, int]
FITTED: frozenset[LevelFilter] = frozenset({"least-squares", "appearance"})
"""Filters that fit a level to level 0."""
BY_LOOKS: frozenset[LevelFilter] = frozenset({"appearance", "raised", "refined"})
"""Filters whose levels depend on the transfer functions."""


@dataclass(frozen=True)
class LevelInput:
    """Codes of level 0, and how they are seen."""

    volume: RawVolume
    """Codes."""
    grid: Grid
    """Where they are."""
    tables: dict[str, Float64Array]
    """Lookup tables of the transfer functions [entries, linear colour and extinction per millimetre], by name."""
    weight_blocks: int | None = None
    """Resolution of visibility along the longest axis (Looks); the default of Looks if None."""
    means: dict[Factors, KeptMeans] = field(default_factory=dict)
    """By factors, of levels that are made without reading level 0."""

    def spacing_mm_zyx(self, factors: Factors) -> tuple[float, float, float]:
        """Distances of the voxels of a level."""
        z, y, x = (f * h for f, h in zip(factors, self.grid.spacing_mm_zyx, strict=True))
        return z, y, x

    def shape_zyx(self, factors: Factors) -> tuple[int, int, int]:
        """Return the shape of a level."""
        z, y, x = (-(-n // f) for n, f in zip(self.grid.shape_zyx, factors, strict=True))
        return z, y, x

    @cached_property
    def looks(self) -> Looks:
        """How values look through all of them."""
        return Looks(list(self.tables.values()), self.volume, self.grid.spacing_mm_zyx, self.weight_blocks)


def look_of(scan: LevelInput, name: LevelFilter, factors: Factors) -> Look:
    """Return how a filter of FITTED looks at values."""
    if name == "appearance":
        return scan.looks.of_level(factors)
    return plain_look(bins_of(scan.volume.dtype), scan.volume.shape_zyx)


def level_slices(scan: LevelInput, name: LevelFilter, factors: tuple[int, int, int]) -> Slices:
    """Return the slices of a level, as a filter makes them, with the number of slices of level 0 that they cover."""
    volume, means = scan.volume, scan.means.get(factors)
    if name in {"raised", "refined"}:
        # Refining begins with the result of "raised".
        return raised_slices(scan, factors, level_slices(scan, "appearance", factors))
    if name in FITTED:
        return fitted_slabs(volume, factors, look_of(scan, name, factors), means)
    kept = {} if means is None else {"box": means.box, "minimum": means.low, "maximum": means.high}
    if name in kept:
        return _kept(kept[name], factors[0], volume.shape_zyx[0])
    noise = noise_of(volume) if name == "feature-preserving" else 0.0
    return reduced_slabs(volume, factors, name, noise)


def raised_slices(scan: LevelInput, factors: Factors, appearance: Slices) -> Slices:
    """Return the slices of the filter "raised": the mean of "appearance" and the maximum of each cell.

    A thin structure that the mean of its cells hides stays above the foot of the transfer function, and the level's own
    table removes the excess.
    """
    depth, factor = scan.volume.shape_zyx[0], factors[0]
    means = scan.means.get(factors)
    first = 0
    for fitted, read in appearance:
        if means is None:
            slab = scan.volume.read_slab(first * factor, min((first + len(fitted)) * factor, depth))
            high = np.empty_like(fitted)
            _native.extrema_reduce(slab, None, high, factors)
        else:
            high = means.high.read_slab(first, first + len(fitted))
        first += len(fitted)
        above = high - fitted
        # Halves are rounded up; a sum of two bytes would not fit into one.
        yield fitted + above // 2 + above % 2, read


def _kept(level: RawVolume, factor: int, depth: int) -> Slices:
    """Return the slices of a level that is on the disk."""
    for z0, z1 in slab_ranges(level.shape_zyx[0], level.slice_bytes):
        yield level.read_slab(z0, z1), min(z1 * factor, depth) - z0 * factor


def written(slices: Slices, path: Path, shape: tuple[int, int, int], advance: Callable[[int], None]) -> RawVolume:
    """Write slices to a file of a volume of `shape`."""
    volume: RawVolume | None = None
    with ExitStack() as stack:
        for voxels, read in slices:
            if volume is None:
                volume = RawVolume(path, shape, voxels.dtype)
                append = stack.enter_context(volume.writing())
            append(voxels)
            advance(read)
    if volume is None:
        msg = "a level without slices"
        raise ValueError(msg)
    return volume
