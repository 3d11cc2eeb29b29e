"""The step of a coarser level, measured on the level itself with its own tables.

Rays are pieces of equal length through places that are seen, some of them along the axes: along these all rays of a
picture meet the voxels in step. Random rays rarely meet a thin vessel, and missing it would not count as an error.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import Compositing
from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.rays import RaySegments, sample_level
from volprep.parts.levels.records import AdaptedTable, MeasuredStep
from volprep.parts.programs.patch_rays import FINE, PatchRays, cosines
from volprep.parts.programs.step_bench import STEP_SHARE, StepBench, in_voxels, longest_step
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import PassTarget
from volprep_formats.package.transfer_function import TransferFunction

_OBLIQUE, _ALONG_AXIS = 240, 80
"""Rays that run oblique to all axes, and along each axis."""
_LENGTHS = 4
"""Lengths of oblique rays: through a single slice some are as long as it is thick, and some run along it. With the
length of the shortest alone, steps of 2 voxels were off by 0.0024 along the rays, and by 0.0095 in a picture."""
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
    layers: PassTarget | None = None
    """Format of the picture, if layers are blended."""
    lit: bool = False
    """Whether samples are lit."""

    def measured(
        self, codes: RawVolume, factors: Factors, own: Sequence[AdaptedTable], off: float = 0.0
    ) -> MeasuredStep | None:
        """Return the longest step that keeps its promise; None if no ray sees anything.

        `off` is the error of the level itself. If it is beyond the tolerance, steps take a quarter of it, which adds
        3 % to it (the root of 1 + 1/16): finer ones would make the level slower than a finer level, and no picture
        better. They never take more than the whole tolerance: what a level holds is always drawn within it.
        """
        rays = self._rays(codes, factors)
        tables = {each.name: Table.exact(each) for each in self.functions}
        for each in own:
            entries = np.array(each.entries)
            values = np.linspace(*self.window, len(entries))
            tables[each.transfer] = tables[each.transfer].with_entries(values, entries)
        exact = list(tables.values())
        bench = StepBench(self.compositing, exact, rays, is_segments=self.is_segments, layers=self.layers)
        if not bench.sees:
            return None
        voxel_mm = min(self.scan.spacing_mm_zyx(factors))
        allowed = self.tolerance
        if off > allowed.rmse:
            rmse = min(off, self.tolerance.rmse / STEP_SHARE)
            maximum = min(1.0, self.tolerance.maximum / STEP_SHARE)
            allowed = allowed.model_copy(update={"rmse": rmse, "maximum": maximum})
        voxels, reason, _ = longest_step(bench, voxel_mm, allowed, self.compositing.step_voxels, _MARGIN)
        return MeasuredStep(step_mm=voxels * voxel_mm, reason=f"{in_voxels(voxels)}: on the level as it is, {reason}")

    def _rays(self, codes: RawVolume, factors: Factors) -> list[PatchRays]:
        """Sample the level along pieces of rays through visible voxels: one record for each length that rays have."""
        spacing_mm_zyx = self.scan.spacing_mm_zyx(factors)
        groups = list(self._groups(factors, _MOST_VOXELS * min(spacing_mm_zyx)))
        if not groups:
            return []
        lines = RaySegments.joined([group for _, group in groups])
        values = self._physical(codes, spacing_mm_zyx, lines)
        steepness = self._steepness(codes, spacing_mm_zyx, lines) if self.lit else None
        rays: list[PatchRays] = []
        first = begin = 0
        for view, group in groups:
            count = len(group.lengths_mm)
            samples = int(values.offsets[begin + 1] - values.offsets[begin])
            each = slice(first, first + count * samples)
            by_ray, length_mm = _by_ray(values.values[each], samples), float(group.lengths_mm[0])
            views = tuple(slice(0, count if number == view else 0) for number in range(4))
            step_mm = length_mm / samples
            shown = None if steepness is None else cosines(by_ray, step_mm, _by_ray(steepness[each], samples))
            rays.append(PatchRays(by_ray, step_mm, views, shown))
            first, begin = each.stop, begin + count
        return rays

    def _groups(self, factors: Factors, most_mm: float) -> Iterator[tuple[int, RaySegments]]:
        """Yield pieces of rays of one length each, with the number of their view: oblique, along x, y, z."""
        blocks, aside = self.scan.looks.seen_blocks, float(max(factors)) / 2
        for view, axis in enumerate((None, 0, 1, 2)):
            count = _OBLIQUE if axis is None else _ALONG_AXIS
            lines = aimed_lines(self.scan.grid, blocks, aside, count, _SEED + view, along=axis)
            order = np.argsort(lines.lengths_mm, kind="stable")
            for chosen in np.array_split(order, _LENGTHS if axis is None else 1):
                if len(chosen):
                    group = lines.taken(chosen)
                    yield view, _cut(group, float(min(group.lengths_mm[0] * (1.0 - 1e-9), most_mm)))

    def _physical(self, codes: RawVolume, spacing_mm_zyx: tuple[float, float, float], lines: RaySegments) -> "_Samples":
        samples = sample_level(codes, spacing_mm_zyx, lines, per_voxel=FINE)
        low, high = self.window
        return _Samples(low + samples.values.astype(np.float64) * samples.scale * (high - low), samples.offsets)

    def _steepness(
        self, codes: RawVolume, spacing_mm_zyx: tuple[float, float, float], lines: RaySegments
    ) -> Float64Array:
        """Return the length of the gradient at each sample, from differences over two voxels along each axis."""
        squared = np.zeros(1)
        for axis, spacing_mm in enumerate(reversed(spacing_mm_zyx)):
            aside_mm = np.eye(3)[axis] * spacing_mm
            behind, ahead = (
                self._physical(codes, spacing_mm_zyx, replace(lines, starts_mm_xyz=lines.starts_mm_xyz + each)).values
                for each in (-aside_mm, aside_mm)
            )
            squared = squared + ((ahead - behind) / (2.0 * spacing_mm)) ** 2
        steepness: Float64Array = np.sqrt(squared)
        return steepness


class _Samples(NamedTuple):
    """Physical values along rays, ray by ray."""

    values: Float64Array
    offsets: NDArray[np.int64]


def _by_ray(values: Float64Array, samples: int) -> Float64Array:
    """Return values of rays that have so many samples each as [sample, ray]."""
    return np.ascontiguousarray(values.reshape(-1, samples).T)


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
