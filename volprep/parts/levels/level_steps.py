"""The step of a coarser level, measured on the level itself with its own tables.

Rays are pieces of equal length through places that are seen, some of them along the axes. Random rays rarely meet a
thin vessel, and missing it would not count as an error.

Others are the rays of pictures of the six sides, from where they enter the box: along these all samples have the same
places between voxels, and where a flat face lies across them, a step is wrong by as much for each ray. In the view on
such a face (engine, levels 1 and 2) the pieces had 0.4 to 0.5 times the error of pictures, these rays have 0.9 to 1.1
times. They have twice the samples: without these they missed a third of the error of a steep function (CT phantom,
level 2).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from volprep.compositing import Compositing
from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.headlight import Shown
from volprep.parts.levels.level_input import Factors, LevelInput
from volprep.parts.levels.view_rays import (
    FINER_PER_VOXEL,
    PER_VOXEL,
    Headlit,
    ViewGroup,
    begun,
    cut,
    picture_lines,
    sampled,
)
from volprep.parts.programs.patch_rays import FINE
from volprep.parts.programs.step_bench import STEP_SHARE, LongestStep, StepBench, in_voxels, longest_step
from volprep.plan.level_choice import AdaptedTable, MeasuredStep
from volprep.scan.slabs import RawVolume
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.parts.normals.record import SOFT_SLOPE, halved_axes
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
_FEW_OF_SIDE, _MANY_OF_SIDE = 24, 120
"""Rays of each side: many where the few leave a doubt. Errors of flat faces (engine) were found with each of 5 seeds,
that of the CT phantom, level 2, with about half of 20."""
_NO_DOUBT = 0.7
"""Part of the promise that the error of the few may have."""
_MOST_OF_SIDE = 480
"""Rays of a side where the error of the many is close to the promise: three sets of 120 were off by 0.0081 to 0.0097 on
the engine, level 2, of 480 with finer samples by 0.0097 to 0.0100; the picture by 0.0101."""
_CLOSE = 0.8
"""Part of the promise from which on an error is close to it."""
_MOST_VOXELS_OF_SIDE = 128
_MARGIN_OF_SIDES = 0.8
"""Pictures of the sides have 0.5 to 1.3 times the error of the many; thin vessels, which the pieces are aimed at, up to
2.3 times."""
_SEED = 17


@dataclass(frozen=True)
class _Level:
    """A level as it is drawn."""

    codes: RawVolume
    factors: Factors
    spacing_mm_zyx: tuple[float, float, float]
    tables: Sequence[Table]

    @property
    def voxel_mm(self) -> float:
        """The smallest edge of a voxel."""
        return min(self.spacing_mm_zyx)


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
    soft_slope: float = SOFT_SLOPE
    """Slope of a place that counts half as a surface."""
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
        tables = {function.name: Table.exact(function) for function in self.functions}
        for table in own:
            entries = np.array(table.entries)
            values = np.linspace(*self.window, len(entries))
            tables[table.transfer] = tables[table.transfer].with_entries(values, entries)
        level = _Level(codes, factors, self.scan.spacing_mm_zyx(factors), list(tables.values()))
        aimed = self._bench(level, list(self._groups(factors, _MOST_VOXELS * level.voxel_mm)), FINE)
        if not aimed.sees:
            return None
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
        usual = self.compositing.step_voxels
        found = self._checked(level, longest_step(aimed, level.voxel_mm, allowed, usual, _MARGIN, part), allowed, part)
        reason = f"{in_voxels(found.voxels)}: on the level as it is, {found.reason}"
        return MeasuredStep(step_mm=found.voxels * level.voxel_mm, reason=reason)

    def _checked(self, level: _Level, found: LongestStep, allowed: Tolerance, part: str) -> LongestStep:
        """Return the step that was found, or the one that the pictures of the sides need, if it is shorter."""
        if not found.keeps:
            return found
        # Where samples are lit, their light is divided further.
        finer = PER_VOXEL if self.lit else FINER_PER_VOXEL
        bench = self._bench(level, list(self._sides(level.voxel_mm, _FEW_OF_SIDE)), PER_VOXEL)
        for part_without_doubt, count, per_voxel in (
            (_NO_DOUBT, _MANY_OF_SIDE, PER_VOXEL),
            (_CLOSE, _MOST_OF_SIDE, finer),
        ):
            doubtful = [
                side
                for side, error in bench.errors(found.voxels * level.voxel_mm).items()
                if max(error.rmse / allowed.rmse, error.maximum / allowed.maximum) > part_without_doubt * STEP_SHARE
            ]
            bench = self._bench(level, list(self._sides(level.voxel_mm, count, doubtful)), per_voxel)
            if not bench.sees:
                return found
            needed = longest_step(bench, level.voxel_mm, allowed, self.compositing.step_voxels, _MARGIN_OF_SIDES, part)
            found = needed if needed.voxels < found.voxels or not needed.keeps else found
            if not found.keeps:
                return found
        return found

    def _bench(self, level: _Level, groups: Sequence[ViewGroup], per_voxel: int) -> StepBench:
        """Sample a level along rays, and give their light."""
        light = None
        if self.lit:
            shown = Shown(level.tables if self.compositing.ends_early else (), self.window)
            halved_zyx = (False, False, False) if self.labelled else halved_axes(level.factors)
            light = Headlit(shown, self.soft_slope / min(self.scan.grid.spacing_mm_zyx), halved_zyx)
        rays = sampled(level.codes, level.spacing_mm_zyx, groups, self.window, light, per_voxel)
        return StepBench(self.compositing, level.tables, rays, is_segments=self.is_segments, layers=self.layers)

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

    def _sides(self, voxel_mm: float, count: int, sides: Sequence[int] = range(6)) -> Iterator[ViewGroup]:
        """Yield so many rays of the picture of each side: along x, y, z, then against them."""
        grid, blocks = self.scan.grid, self.scan.looks.seen_blocks
        block_mm = blocks.edge * np.array(grid.spacing_mm_zyx[::-1])
        corners_mm = np.argwhere(blocks.seen)[:, ::-1] * block_mm
        for side in sides:
            direction = np.eye(3)[side % 3] * (1 if side < 3 else -1)
            generator = np.random.default_rng(_SEED + side)
            lines = picture_lines(grid, corners_mm, block_mm, direction, count, generator)
            if len(lines.lengths_mm):
                yield ViewGroup(side, begun(lines, _MOST_VOXELS_OF_SIDE * voxel_mm))
