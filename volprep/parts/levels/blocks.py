"""Which filters are worth a whole level: those that are nearly the best on blocks of the volume.

Two blocks along each axis, about its quarters, so that each place of the volume is near one of them. Their size hardly
depends on that of the volume: what is tried costs the same for a scan of 1 GB and of 20 GB. What is nearly the best
there makes the whole level, and its light along rays through all of the volume decides.
"""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.joint_histogram import joint_counts, reference_mm, shares_of_counts
from volprep.parts.levels.light import Histogram, RayLight, Sampled, score
from volprep.parts.levels.made import Classified, Factors, level_slices
from volprep.parts.levels.rays import random_lines, sample_sets
from volprep.parts.levels.records import Trial
from volprep.scan.slabs import RawVolume
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter

_MARGIN = 1.15
"""Filters whose error on blocks is below the least by this make the whole level."""
_CELLS = 12
"""Voxels of the level along an axis of a block at least, a third of which its faces reach."""
_EDGE = 96
"""Voxels of level 0 along an axis of a block, unless its cells need more."""
_RAYS, _CHECK_RAYS = 250, 125
"""Through each block."""
_WEIGHTS = 24
"""Along an axis of a block: as fine as those of a volume of 500 voxels are."""
_LARGEST_IN_MEMORY_BYTES = 2**26
"""Larger blocks, of levels far down, are read slab by slab for each filter."""
_LARGEST_SHARE = 1 / 4
"""Blocks that are more of the volume save too little."""


@dataclass(frozen=True)
class _InMemory(RawVolume):
    """Voxels that are no file."""

    voxels: NDArray[np.generic]

    @classmethod
    def of(cls, voxels: NDArray[np.generic]) -> "_InMemory":
        z, y, x = voxels.shape
        return cls(Path(), (z, y, x), voxels.dtype, voxels)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        return self.voxels[z0:z1]


@dataclass(frozen=True)
class _OnFile(RawVolume):
    """A part of a volume, left where it is."""

    whole: RawVolume
    ranges_zyx: tuple[tuple[int, int], tuple[int, int], tuple[int, int]]

    @classmethod
    def of(cls, whole: RawVolume, ranges_zyx: tuple[tuple[int, int], tuple[int, int], tuple[int, int]]) -> "_OnFile":
        z, y, x = (stop - start for start, stop in ranges_zyx)
        return cls(Path(), (z, y, x), whole.dtype, whole, ranges_zyx)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        (first, _), y, x = self.ranges_zyx
        rows = self.whole.read_rows(slice(first + z0, first + z1), slice(*y))
        return np.ascontiguousarray(rows[:, :, slice(*x)])


def promising(
    scan: Classified, factors: Factors, candidates: Sequence[LevelFilter], *, adapt: bool, editable: bool
) -> tuple[tuple[LevelFilter, ...], tuple[Trial, ...]]:
    """Return the filters that may be the best, and what was measured; all of them where blocks would save little."""
    ranges = [_ranges(n, factor) for n, factor in zip(scan.grid.shape_zyx, factors, strict=True)]
    voxels = math.prod(sum(stop - start for start, stop in axis) for axis in ranges)
    if len(candidates) == 1 or voxels > _LARGEST_SHARE * math.prod(scan.grid.shape_zyx):
        return tuple(candidates), ()
    fine: list[Sampled] = []
    levels = {name: _Tried() for name in candidates}
    for seed, block in enumerate(_blocks(scan, ranges)):
        lines = [random_lines(block.grid, count, 2 * seed + k) for k, count in enumerate((_RAYS, _CHECK_RAYS))]
        fine.append(Sampled(*sample_sets(block.volume, block.grid.spacing_mm_zyx, lines)))
        for name, tried in levels.items():
            began = time.perf_counter()
            level = _InMemory.of(np.concatenate([each for each, _ in level_slices(block, name, factors)]))
            tried.seconds += time.perf_counter() - began
            tried.samples.append(Sampled(*sample_sets(level, block.spacing_mm_zyx(factors), lines)))
            if editable:
                tried.counts += joint_counts(block.volume, level, factors)
    light = RayLight(scan.tables, Sampled.joined(fine), adapt=adapt)
    trials = {name: tried.compared(light, name, scan, factors) for name, tried in levels.items()}
    units = trials[candidates[0]]
    scores = {name: score(each, units, editable=editable) for name, each in trials.items()}
    near = tuple(name for name in candidates if scores[name] <= _MARGIN * min(scores.values()))
    return near, tuple(trial.model_copy(update={"on": "blocks"}) for each in trials.values() for trial in each)


class _Tried:
    """What a filter made of all blocks."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.samples: list[Sampled] = []
        self.counts = np.zeros((256, 256), np.uint64)

    def compared(self, light: RayLight, name: LevelFilter, scan: Classified, factors: Factors) -> list[Trial]:
        histogram = None
        if self.counts.any():
            histogram = Histogram(shares_of_counts(self.counts), reference_mm(scan.spacing_mm_zyx(factors)))
        _, trials = light.compared(name, Sampled.joined(self.samples), histogram, self.seconds)
        return trials


def _ranges(voxels: int, factor: int) -> list[tuple[int, int]]:
    """Where blocks lie along an axis, at whole cells: the whole of a short one, else two parts."""
    edge = max(_EDGE // factor, _CELLS) * factor
    if voxels < 2.5 * edge:
        return [(0, voxels)]
    starts = (round((quarter * voxels / 4 - edge / 2) / factor) * factor for quarter in (1, 3))
    return [(start, start + edge) for start in starts]


def _blocks(scan: Classified, ranges: Sequence[Sequence[tuple[int, int]]]) -> Iterator[Classified]:
    for z, y, x in product(*ranges):
        part = _OnFile.of(scan.volume, (z, y, x))
        volume: RawVolume = part
        if part.slice_bytes * part.shape_zyx[0] <= _LARGEST_IN_MEMORY_BYTES:
            volume = _InMemory.of(part.read_slab(0, part.shape_zyx[0]))
        yield Classified(volume, Grid.of(part.shape_zyx, scan.grid.spacing_mm_zyx), scan.tables, _WEIGHTS)
