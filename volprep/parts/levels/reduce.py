"""A level of a pyramid from level 0, by any of the filters: whole, or slab by slab with the same bytes.

Levels are never made from levels: means of rounded means drift, and what one level dropped the next cannot have. One
filter does so, to compare with: two-step-bilinear. A cell that hangs over the edge of an odd size sees the edge
repeated.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.levels.weights import LinearFilter, Weights, weights
from volprep.scan.slabs import RawVolume, slab_ranges
from volprep_formats.package.channel import LevelFilter

Voxels = NDArray[Any]
Factors = tuple[int, int, int]

LABEL_FILTERS: frozenset[LevelFilter] = frozenset({"mode", "mode-foreground", "nearest"})
"""Filters that give a label of the cell, never a value between two labels."""


@dataclass(frozen=True)
class Slab:
    """Some slices of level 0, and which slices of the level are to be made of them."""

    voxels: Voxels
    """Slices of level 0 [z, y, x]."""
    first: int
    """Number of the first of them."""
    depth: int
    """Number of slices of level 0."""
    level_first: int
    """Number of the first slice of the level."""
    level: Voxels
    """Slices of the level [z, y, x], to be written."""


Kernel = Callable[[Slab, Factors], None]


@dataclass(frozen=True)
class Filter:
    """How a filter makes slices of a level."""

    kernel: Kernel
    """Writes `Slab.level`."""
    reach: int = 0
    """Slices beyond the cells that it needs on either side."""


def reduced(volume: Voxels, factors_zyx: Factors, name: LevelFilter, noise: float = 0.0) -> Voxels:
    """Return the level that a filter makes of a whole volume [z, y, x].

    `noise` is the standard deviation of the noise in units of the voxels (volprep.parts.levels.noise); only
    "feature-preserving" asks for it.
    """
    depth = volume.shape[0]
    level = np.empty(_native.box_reduced_shape(volume.shape, factors_zyx), volume.dtype)
    slab = Slab(np.ascontiguousarray(volume), first=0, depth=depth, level_first=0, level=level)
    _filter(name, factors_zyx, noise).kernel(slab, factors_zyx)
    return level


def reduced_slabs(
    volume: RawVolume, factors_zyx: Factors, name: LevelFilter, noise: float = 0.0
) -> Iterator[tuple[Voxels, int]]:
    """Return the slices of the level in order, a few at a time, with the number of slices of level 0 that they cover.

    The bytes equal the result of `reduced`. Memory holds a slab of level 0 and the slices that the filter reaches
    beyond it.
    """
    chosen = _filter(name, factors_zyx, noise)
    depth = volume.shape_zyx[0]
    # Slabs of whole cells: each gives slices of the level that no other slab touches.
    for z0, z1 in slab_ranges(depth, volume.slice_bytes, multiple=factors_zyx[0]):
        first, stop = max(z0 - chosen.reach, 0), min(z1 + chosen.reach, depth)
        shape = _native.box_reduced_shape((z1 - z0, *volume.shape_zyx[1:]), factors_zyx)
        level = np.empty(shape, volume.dtype)
        slab = Slab(volume.read_slab(first, stop), first, depth, z0 // factors_zyx[0], level)
        chosen.kernel(slab, factors_zyx)
        yield level, z1 - z0


def _filter(name: LevelFilter, factors_zyx: Factors, noise: float) -> Filter:
    match name:
        case "bilinear" | "binomial" | "gaussian" | "lanczos3":
            return _linear(name, factors_zyx)
        case "feature-preserving":
            return _feature_preserving(factors_zyx, noise)
        case _:
            return Filter(_BLOCKS[name])


def _linear(name: LinearFilter, factors_zyx: Factors) -> Filter:
    taps_z, taps_y, taps_x = (weights(name, factor) for factor in factors_zyx)

    def kernel(slab: Slab, factors: Factors) -> None:
        _native.linear_reduce(
            slab.voxels,
            slab.level,
            factors,
            taps_z,
            taps_y,
            taps_x,
            # Negative weights would add values that nothing in their reach has.
            clamp=name == "lanczos3",
            src_z=slab.first,
            dst_z=slab.level_first,
            depth=slab.depth,
        )

    return Filter(kernel, _reach(taps_z, factors_zyx[0]))


def _feature_preserving(factors_zyx: Factors, noise: float) -> Filter:
    taps_z, taps_y, taps_x = (weights("binomial", factor) for factor in factors_zyx)

    def kernel(slab: Slab, factors: Factors) -> None:
        _native.feature_reduce(
            slab.voxels,
            slab.level,
            factors,
            taps_z,
            taps_y,
            taps_x,
            noise,
            src_z=slab.first,
            dst_z=slab.level_first,
            depth=slab.depth,
        )

    return Filter(kernel, _reach(taps_z, factors_zyx[0]))


def _reach(taps: Weights, factor: int) -> int:
    return max(0, (len(taps) - factor) // 2)


def _two_step(slab: Slab, factors: Factors) -> None:
    """Halve again and again, as Schultz and Bailey's volume renderer does (7.1.2): each step rounds to codes twice."""
    voxels = slab.voxels
    for z, y, x in _halvings(factors):
        for step in ((1, y, x), (z, 1, 1)):
            halved = np.empty(_native.box_reduced_shape(voxels.shape, step), voxels.dtype)
            # Between two voxels, linear interpolation in the middle is the mean.
            _native.box_reduce(voxels, halved, step)
            voxels = halved
    slab.level[...] = voxels


def _halvings(factors: Factors) -> Iterator[Factors]:
    """Return the factors of each halving, 1 or 2: axes of larger factors come first, as levels are chosen."""
    for left in range(max(factors).bit_length() - 1, 0, -1):
        z, y, x = (2 if factor >> left else 1 for factor in factors)
        yield z, y, x


_BLOCKS: dict[LevelFilter, Kernel] = {
    "two-step-bilinear": _two_step,
    "nearest": lambda slab, factors: _native.nearest_reduce(slab.voxels, slab.level, factors),
    "box": lambda slab, factors: _native.box_reduce(slab.voxels, slab.level, factors),
    "minimum": lambda slab, factors: _native.extrema_reduce(slab.voxels, slab.level, None, factors),
    "maximum": lambda slab, factors: _native.extrema_reduce(slab.voxels, None, slab.level, factors),
    "median": lambda slab, factors: _native.median_reduce(slab.voxels, slab.level, factors),
    "mode": lambda slab, factors: _native.mode_reduce(slab.voxels, slab.level, factors),
    "mode-foreground": lambda slab, factors: _native.mode_reduce(slab.voxels, slab.level, factors, background=0),
}
"""Filters that look at the cell alone: whole cells are all that a slab needs."""
