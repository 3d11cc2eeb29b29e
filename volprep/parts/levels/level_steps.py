"""The step of a coarser level, measured on the level itself with its own tables.

Rays are pieces of equal length through places that are seen, some of them along the axes: along these all rays of a
picture meet the voxels in step. Random rays rarely meet a thin vessel, and missing it would not count as an error.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from volprep.compositing import Compositing
from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.headlight import Shown
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.view_rays import Headlit, ViewGroup, cut, sampled
from volprep.parts.programs.patch_rays import PatchRays
from volprep.parts.programs.step_bench import STEP_SHARE, StepBench, in_voxels, longest_step
from volprep.plan.level_choice import AdaptedTable, MeasuredStep
from volprep.scan.slabs import RawVolume
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.parts.normals.record import LEAST_SLOPE, halved_axes
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
    labelled: bool = False
    """Whether segments are drawn, whose shaders take differences of whole voxels at every level."""

    def measured(
        self, codes: RawVolume, factors: Factors, own: Sequence[AdaptedTable], off: float = 0.0
    ) -> MeasuredStep | None:
        """Return the longest step that keeps its promise; None if no ray sees anything.

        `off` is the error of the level itself. If it is beyond the tolerance, steps take a quarter of it, which adds
        3 % to it (the root of 1 + 1/16): finer ones would make the level slower than a finer level, and no picture
        better. They never take more than the whole tolerance: what a level holds is always drawn within it.
        """
        tables = {each.name: Table.exact(each) for each in self.functions}
        for each in own:
            entries = np.array(each.entries)
            values = np.linspace(*self.window, len(entries))
            tables[each.transfer] = tables[each.transfer].with_entries(values, entries)
        exact = list(tables.values())
        rays = self._rays(codes, factors, exact)
        bench = StepBench(self.compositing, exact, rays, is_segments=self.is_segments, layers=self.layers)
        if not bench.sees:
            return None
        voxel_mm = min(self.scan.spacing_mm_zyx(factors))
        allowed, part = self.tolerance, "a quarter of the tolerance"
        if off > allowed.rmse:
            rmse = min(off, self.tolerance.rmse / STEP_SHARE)
            maximum = min(1.0, self.tolerance.maximum / STEP_SHARE)
            allowed = allowed.model_copy(update={"rmse": rmse, "maximum": maximum})
            part = (
                "a quarter of the level's own error"
                if rmse == off
                else "the tolerance, for the level itself is far off"
            )
        voxels, reason, _ = longest_step(bench, voxel_mm, allowed, self.compositing.step_voxels, _MARGIN, part)
        return MeasuredStep(step_mm=voxels * voxel_mm, reason=f"{in_voxels(voxels)}: on the level as it is, {reason}")

    def _rays(self, codes: RawVolume, factors: Factors, tables: Sequence[Table]) -> list[PatchRays]:
        """Sample the level along pieces of rays through visible voxels: one record for each length that rays have."""
        spacing_mm_zyx = self.scan.spacing_mm_zyx(factors)
        groups = list(self._groups(factors, _MOST_VOXELS * min(spacing_mm_zyx)))
        light = None
        if self.lit:
            shown = Shown(tables if self.compositing.ends_early else (), self.window)
            halved_zyx = (False, False, False) if self.labelled else halved_axes(factors)
            light = Headlit(shown, LEAST_SLOPE / min(self.scan.grid.spacing_mm_zyx), halved_zyx)
        return sampled(codes, spacing_mm_zyx, groups, self.window, light)

    def _groups(self, factors: Factors, most_mm: float) -> Iterator[ViewGroup]:
        """Yield pieces of rays of one length each. Views are: oblique ones together, along x, y, z."""
        blocks, aside = self.scan.looks.seen_blocks, float(max(factors)) / 2
        for view, axis in enumerate((None, 0, 1, 2)):
            count = _OBLIQUE if axis is None else _ALONG_AXIS
            lines = aimed_lines(self.scan.grid, blocks, aside, count, _SEED + view, along=axis)
            order = np.argsort(lines.lengths_mm, kind="stable")
            for chosen in np.array_split(order, _LENGTHS if axis is None else 1):
                if len(chosen):
                    group = lines.taken(chosen)
                    length_mm = float(min(group.lengths_mm[0] * (1.0 - 1e-9), most_mm))
                    yield ViewGroup(view, cut(group, length_mm, _SEED))
