"""A level as a filter makes it of codes of level 0, which are seen through transfer functions."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.fitted import fitted_slabs
from volprep.parts.levels.look import Look, Looks, bins_of, plain_look
from volprep.parts.levels.means import KeptMeans
from volprep.parts.levels.noise import noise_of
from volprep.parts.levels.reduce import reduced_slabs
from volprep.scan.slabs import RawVolume, bytes_of, slab_ranges
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter

Slices = Iterator[tuple[NDArray[Any], int]]
Factors = tuple[int, int, int]
FITTED: frozenset[LevelFilter] = frozenset({"least-squares", "appearance"})
"""Filters that fit a level to level 0."""


@dataclass(frozen=True)
class Classified:
    """Codes of level 0, and how they are seen."""

    volume: RawVolume
    """Codes."""
    grid: Grid
    """Where they are."""
    tables: dict[str, Float64Array]
    """Lookup tables of the transfer functions [entries, linear colour and extinction per millimetre], by name."""
    weight_blocks: int | None = None
    """Along the longest axis: how finely it is told what is seen (Looks); as Looks does where it is None."""
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


def look_of(scan: Classified, name: LevelFilter, factors: Factors) -> Look:
    """Return how a filter of FITTED looks at values."""
    if name == "appearance":
        return scan.looks.of_level(factors)
    return plain_look(bins_of(scan.volume.dtype), scan.volume.shape_zyx)


def level_slices(scan: Classified, name: LevelFilter, factors: tuple[int, int, int]) -> Slices:
    """Return the slices of a level, as a filter makes them, with how many slices of level 0 they stand for."""
    volume, means = scan.volume, scan.means.get(factors)
    if name in FITTED:
        return fitted_slabs(volume, factors, look_of(scan, name, factors), means)
    if name == "box" and means is not None:
        return _kept(means.box, factors[0], volume.shape_zyx[0])
    noise = noise_of(volume) if name == "feature-preserving" else 0.0
    return reduced_slabs(volume, factors, name, noise)


def _kept(level: RawVolume, factor: int, depth: int) -> Slices:
    """Return the slices of a level that is on the disk."""
    for z0, z1 in slab_ranges(level.shape_zyx[0], level.slice_bytes):
        yield level.read_slab(z0, z1), min(z1 * factor, depth) - z0 * factor


def written(slices: Slices, path: Path, shape: tuple[int, int, int], advance: Callable[[int], None]) -> RawVolume:
    """Write slices to a file of a volume of `shape`."""
    dtype: np.dtype[np.generic] | None = None
    with path.open("wb") as file:
        for voxels, read in slices:
            file.write(bytes_of(voxels))
            dtype = voxels.dtype
            advance(read)
    if dtype is None:
        msg = "a level without slices"
        raise ValueError(msg)
    return RawVolume(path, shape, dtype)
