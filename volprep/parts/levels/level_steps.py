"""The step of a coarser level, measured on the level itself with its own tables.

Rays are pieces of equal length through places that are seen, some of them along the axes: along these all rays of a
picture meet the voxels in step. Random rays rarely meet a thin vessel, and missing it would not count as an error.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.compositing import Compositing
from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.rays import RaySegments, sample_level
from volprep.parts.levels.records import AdaptedTable, MeasuredStep
from volprep.parts.programs.patch_rays import FINE, PatchRays
from volprep.parts.programs.step_bench import StepBench, in_voxels, longest_step
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.transfer_function import TransferFunction

_OBLIQUE, _ALONG_AXIS = 240, 80
"""Rays that run oblique to all axes, and along each axis."""
_MOST_VOXELS = 96
"""Length of a ray, in voxels of the level, at most: longer ones see nothing else, and cost more."""
_MARGIN = 0.6
"""The worst of 17 views has up to 1.7 times the error of such rays (vessels, cracks, soft tissue; levels 1 and 2)."""
_SEED = 17


@dataclass(frozen=True)
class LevelSteps:
    """Measures the steps of the levels of a channel."""

    scan: LevelInput
    """Codes of level 0."""
    window: tuple[float, float]
    """Physical values of the smallest code and the largest."""
    functions: Sequence[TransferFunction]
    """Transfer functions."""
    compositing: Compositing
    """The compositing."""
    is_segments: bool
    """Whether segments are classified, by pre-integrated tables, and not samples."""
    tolerance: Tolerance
    """The scene's."""

    def measured(
        self, codes: RawVolume, factors: Factors, own: Sequence[AdaptedTable], off: float = 0.0
    ) -> MeasuredStep | None:
        """Return the longest step that keeps its promise; None if no ray sees anything.

        `off` is the error of the level itself. If it is beyond the tolerance, steps take a part of it: finer ones would
        make the level slower than a finer level, and no picture better.
        """
        rays = self._rays(codes, factors)
        if rays is None:
            return None
        tables = {each.name: Table.exact(each) for each in self.functions}
        for each in own:
            entries = np.array(each.entries)
            values = np.linspace(*self.window, len(entries))
            tables[each.transfer] = tables[each.transfer].with_entries(values, entries)
        bench = StepBench(self.compositing, list(tables.values()), rays, is_segments=self.is_segments)
        if not bench.sees:
            return None
        voxel_mm = min(self.scan.spacing_mm_zyx(factors))
        allowed = self.tolerance
        if off > allowed.rmse:
            allowed = allowed.model_copy(update={"rmse": min(off, 1.0), "maximum": 1.0})
        voxels, reason = longest_step(bench, voxel_mm, allowed, self.compositing.step_voxels, _MARGIN)
        return MeasuredStep(step_mm=voxels * voxel_mm, reason=f"{in_voxels(voxels)}: on the level as it is, {reason}")

    def _rays(self, codes: RawVolume, factors: Factors) -> PatchRays | None:
        """Sample the level along pieces of rays through visible voxels."""
        spacing_mm_zyx = self.scan.spacing_mm_zyx(factors)
        length_mm = self._length_mm(min(spacing_mm_zyx))
        blocks, aside = self.scan.looks.seen_blocks, float(max(factors)) / 2
        pieces, views, begin = [], [], 0
        for seed, axis in enumerate((None, 0, 1, 2)):
            count = _OBLIQUE if axis is None else _ALONG_AXIS
            lines = aimed_lines(self.scan.grid, blocks, aside, count, _SEED + seed, along=axis)
            cut = _cut(lines, length_mm)
            pieces.append(cut)
            views.append(slice(begin, begin + len(cut.lengths_mm)))
            begin += len(cut.lengths_mm)
        if not begin:
            return None
        samples = sample_level(codes, spacing_mm_zyx, RaySegments.joined(pieces), per_voxel=FINE)
        low, high = self.window
        values: Float64Array = low + samples.values.astype(np.float64) * samples.scale * (high - low)
        by_ray = np.ascontiguousarray(values.reshape(begin, -1).T)
        return PatchRays(by_ray, length_mm / len(by_ray), tuple(views))

    def _length_mm(self, voxel_mm: float) -> float:
        """Return a length that most rays have: that of the shortest axis of the box, but no more than is useful."""
        shortest_mm = min(n * h for n, h in zip(self.scan.grid.shape_zyx, self.scan.grid.spacing_mm_zyx, strict=True))
        return float(min(shortest_mm * (1.0 - 1e-9), _MOST_VOXELS * voxel_mm))


def _cut(lines: RaySegments, length_mm: float) -> RaySegments:
    """Return pieces of this length, begun where a voxel or so of chance says; shorter rays are dropped."""
    kept = np.flatnonzero(lines.lengths_mm >= length_mm)
    longer = lines.taken(kept)
    share = np.random.default_rng(_SEED).random(len(kept))
    aside_mm = share * (longer.lengths_mm - length_mm)
    # A third begins where rays enter the box, as the rays of pictures do.
    aside_mm[::3] = 0.0
    starts = longer.starts_mm_xyz + aside_mm[:, None] * longer.directions_xyz
    return RaySegments(starts, longer.directions_xyz, np.full(len(kept), math.nextafter(length_mm, 0.0)))
