"""Preselect the filters worth computing a whole level with: the ones that are nearly the best on blocks of the volume.

Two blocks along each axis, about its quarters, so that each place of the volume is near one of them. Their size hardly
depends on that of the volume: the trial costs the same for a scan of 1 GB and of 20 GB. Filters that are nearly the
best there make the whole level, and its light along rays through the whole volume decides.
"""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.joint_histogram import joint_counts, reference_mm, shares_of_counts
from volprep.parts.levels.level_input import Factors, LevelInput, level_slices, raised_slices
from volprep.parts.levels.light import Histogram, RayLight, Sampled, score
from volprep.parts.levels.rays import RaySegments, random_lines, sample_sets
from volprep.plan.level_choice import Trial
from volprep.scan.in_memory import InMemory
from volprep.scan.slabs import RawVolume
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter

_MARGIN = 1.15
"""Filters whose error on blocks is below the least by this make the whole level."""
_CELLS = 12
"""Minimum number of voxels of the level along an axis of a block; a third of them lie within reach of its faces."""
_EDGE = 96
"""Voxels of level 0 along an axis of a block, unless its cells need more."""
_RAYS, _CHECK_RAYS = 250, 125
"""Through each block; half of them are aimed at visible voxels."""
_WEIGHTS = 24
"""Along an axis of a block: as fine as for a volume of 500 voxels."""
_LARGEST_IN_MEMORY_BYTES = 2**26
"""Larger blocks, of levels far down, are read slab by slab for each filter."""
_LARGEST_SHARE = 1 / 4
"""Blocks that are more of the volume save too little."""


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

    def read_rows(self, z: slice, y: slice) -> NDArray[np.generic]:
        (first_z, _), (first_y, _), x = self.ranges_zyx
        rows = self.whole.read_rows(
            slice(first_z + z.start, first_z + z.stop), slice(first_y + y.start, first_y + y.stop)
        )
        return np.ascontiguousarray(rows[:, :, slice(*x)])


def promising(
    scan: LevelInput, factors: Factors, candidates: Sequence[LevelFilter], *, adapt: bool, editable: bool
) -> tuple[tuple[LevelFilter, ...], tuple[Trial, ...]]:
    """Return the filters that may be the best, and the measurements; all filters if blocks would save little."""
    ranges = [_ranges(n, factor) for n, factor in zip(scan.grid.shape_zyx, factors, strict=True)]
    voxels = math.prod(sum(stop - start for start, stop in axis) for axis in ranges)
    if len(candidates) == 1 or voxels > _LARGEST_SHARE * math.prod(scan.grid.shape_zyx):
        return tuple(candidates), ()
    fine: list[Sampled] = []
    levels = {name: _Tried() for name in candidates}
    for seed, block in enumerate(_blocks(scan, ranges)):
        lines = _lines(block, factors, 3 * seed)
        fine.append(Sampled(*sample_sets(block.volume, block.grid.spacing_mm_zyx, lines)))
        made: dict[LevelFilter, NDArray[np.generic]] = {}
        for name, tried in levels.items():
            began = time.perf_counter()
            made[name] = _made(block, name, factors, made.get("appearance"))
            level = InMemory.of(made[name])
            tried.seconds += time.perf_counter() - began
            tried.samples.append(Sampled(*sample_sets(level, block.spacing_mm_zyx(factors), lines)))
            if editable:
                tried.counts += joint_counts(block.volume, level, factors)
    light = RayLight(scan.tables, Sampled.joined(fine), adapt=adapt)
    trials = {name: tried.compared(light, name, scan, factors) for name, tried in levels.items()}
    units = trials[candidates[0]]
    scores = {name: score(trial, units, editable=editable) for name, trial in trials.items()}
    near = [name for name in candidates if scores[name] <= _MARGIN * min(scores.values())]
    if near.count("appearance") + near.count("raised") == 2:
        # Both take the same fit, the dearest part of a level: blocks tell which is the better one.
        near.remove(max(("appearance", "raised"), key=scores.__getitem__))
    return tuple(near), tuple(trial.model_copy(update={"on": "blocks"}) for found in trials.values() for trial in found)


def _made(
    block: LevelInput, name: LevelFilter, factors: Factors, appearance: NDArray[np.generic] | None
) -> NDArray[np.generic]:
    """Return the level of a block; "raised" begins with that of "appearance", if it is known."""
    slices = level_slices(block, name, factors)
    if name == "raised" and appearance is not None:
        slices = raised_slices(block, factors, iter([(appearance, block.grid.shape_zyx[0])]))
    return np.concatenate([value for value, _ in slices])


def _lines(block: LevelInput, factors: Factors, seed: int) -> list[RaySegments]:
    """Return rays through a block to fit along, to check along by chance, and aimed ones to choose along."""
    blocks, aside = block.looks.seen_blocks, float(max(factors))
    fit, check = (random_lines(block.grid, count, seed + k) for k, count in enumerate((_RAYS // 2, _CHECK_RAYS)))
    at_seen = aimed_lines(block.grid, blocks, aside, _RAYS // 2, seed)
    chosen = aimed_lines(block.grid, blocks, aside, _CHECK_RAYS, seed + 2)
    # In a block that shows nothing there is nothing to aim at.
    return [RaySegments.joined([fit, at_seen]), check, chosen if len(chosen.lengths_mm) else check]


class _Tried:
    """One filter's result for all blocks."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.samples: list[Sampled] = []
        self.counts = np.zeros((256, 256), np.uint64)

    def compared(self, light: RayLight, name: LevelFilter, scan: LevelInput, factors: Factors) -> list[Trial]:
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


def _blocks(scan: LevelInput, ranges: Sequence[Sequence[tuple[int, int]]]) -> Iterator[LevelInput]:
    for z, y, x in product(*ranges):
        part = _OnFile.of(scan.volume, (z, y, x))
        volume: RawVolume = part
        if part.slice_bytes * part.shape_zyx[0] <= _LARGEST_IN_MEMORY_BYTES:
            volume = InMemory.of(part.read_slab(0, part.shape_zyx[0]))
        yield LevelInput(volume, Grid.of(part.shape_zyx, scan.grid.spacing_mm_zyx), scan.tables, _WEIGHTS)
