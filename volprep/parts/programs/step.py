"""How far apart the samples of a ray are, for each level: as far as the error is a small part of the tolerance.

Measured on rays through patches of the source (`patch_rays`). A ray is cut into equal segments, as shaders do it, and
drawn with one sample for each, or, with pre-integrated tables, with the exact light of a straight segment. The truth
are pieces so short that shorter ones change nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.kernels import _native
from volprep.parts.programs.patch_rays import PatchRays, patch_rays
from volprep.parts.values.labels import label_step_voxels
from volprep.plan.probe import PictureDifference, difference, worst
from volprep.plan.records import LevelPlan
from volprep.scan.statistics import Measured
from volprep.scene.scene import RenderWishes, Scene
from volprep.techniques import TECHNIQUES
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import LevelStep, PlanItem, RenderSettings, Tolerance
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo

STEP_SHARE = 0.25
"""Part of the tolerance that samples may take; codes may take a half."""
_VOXELS = (2.0, 1.4, 1.0, 0.7, 0.5, 0.35, 0.25)
"""Steps that are tried, in voxels of the level. Half as long is four times as exact; beyond 2 a few rays do not tell
what small things samples miss."""
_SEEN = 1 / 510
"""Rays of less opacity than a rounding of 8 bits do not count: many of them would make a bad step look good."""


@dataclass(frozen=True)
class StepChoice:
    """The step of one level."""

    level: int
    """Number of the level."""
    step_mm: float
    """Distance of the samples along a ray."""
    reason: str
    """Why."""
    in_pieces: bool = False
    """Whether the package holds the level in sub-volumes only."""


def choose_steps(
    scene: Scene,
    functions: Sequence[TransferFunction],
    info: SourceInfo,
    measured: Measured,
    *,
    grid: Grid,
    levels: Sequence[LevelPlan],
    in_pieces: Sequence[LevelPlan] = (),
) -> tuple[StepChoice, ...]:
    """Choose the step of each level of a channel; `grid` is that of level 0, a part of the source's.

    `in_pieces` are levels that the package holds in sub-volumes only.
    """
    wanted = scene.render.step_voxels
    technique = TECHNIQUES[scene.render.technique]
    usual = technique.step_voxels or COMPOSITINGS[scene.render.compositing].step_voxels
    chosen: list[StepChoice] = []
    for level in (*in_pieces, *levels):
        z, y, x = (f * h for f, h in zip(level.factors_zyx, grid.spacing_mm_zyx, strict=True))
        voxel_mm = min(z, y, x)
        if wanted != "auto":
            voxels, reason = wanted, "as the scene states"
        elif scene.source.labels:
            voxels = label_step_voxels(functions, voxel_mm, scene.tolerance)
            reason = "along one step the densest label stays within a quarter of the largest error"
        elif technique.step_voxels is not None:
            voxels, reason = usual, f"layers of technique {scene.render.technique} are rounded one by one, and so few"
        elif COMPOSITINGS[scene.render.compositing].isovalue:
            voxels, reason = usual, "a few rays do not tell where longer steps miss a surface"
        elif scene.editable:
            voxels, reason = usual, "users may edit the functions that it would be measured with"
        else:
            patches = np.stack([_reduced(patch, level.factors_zyx) for patch in measured.stored_patches])
            patches *= info.slope
            patches += info.intercept
            rays = patch_rays(patches, (z, y, x), float(np.mean(grid.extent_mm_zyx)))
            bench = _Bench(scene.render, functions, rays)
            voxels, reason = _longest(bench, voxel_mm, scene.tolerance)
        chosen.append(
            StepChoice(level.index, voxels * voxel_mm, f"{_voxels(voxels)}: {reason}", in_pieces=level in in_pieces)
        )
    return tuple(chosen)


def common_steps(channels: Sequence[Sequence[StepChoice]]) -> tuple[float, tuple[LevelStep, ...]]:
    """Return the step of the finest level that is held whole, and those of the others that have another one.

    Of several channels the finest step of any counts.
    """
    by_level: dict[int, float] = {}
    choices = [choice for channel in channels for choice in channel]
    for choice in choices:
        by_level[choice.level] = min(choice.step_mm, by_level.get(choice.level, choice.step_mm))
    step_mm = by_level[min(choice.level for choice in choices if not choice.in_pieces)]
    others = (
        LevelStep(level=level, step_mm=by_level[level]) for level in sorted(by_level) if by_level[level] != step_mm
    )
    return step_mm, tuple(others)


def describe_steps(render: RenderSettings, choices: Sequence[StepChoice]) -> Iterator[PlanItem]:
    """Say for each level of a channel how far apart samples are, and why."""
    for choice in choices:
        step_mm = render.step_of(choice.level)
        shared = "" if step_mm == choice.step_mm else f"; here {step_mm:.3g} mm, for another channel"
        reason = f"{choice.step_mm:.3g} mm, {choice.reason}{shared}"
        yield PlanItem(name=f"step of level {choice.level}", kept=True, reason=reason)


def _voxels(number: float) -> str:
    return "1 voxel" if number == 1 else f"{number:.3g} voxels"


def _reduced(patch: NDArray[np.generic], factors_zyx: tuple[int, int, int]) -> Float64Array:
    """Return the means of so many voxels of a patch; what is missing at the end of an axis is its last voxel."""
    means: Float64Array = patch.astype(np.float64)
    # Axis by axis: a patch is as deep as the volume, and cells may be wider than a patch.
    for axis, factor in enumerate(factors_zyx):
        missing = [(0, -n % factor if each == axis else 0) for each, n in enumerate(means.shape)]
        padded = np.pad(means, missing, mode="edge")
        shape = padded.shape
        means = padded.reshape(*shape[:axis], -1, factor, *shape[axis + 1 :]).mean(axis=axis + 1)
    return means


def _longest(bench: "_Bench", voxel_mm: float, tolerance: Tolerance) -> tuple[float, str]:
    """Return the longest step in voxels whose error is within its part of the tolerance, and the reason."""
    limit = PictureDifference(STEP_SHARE * tolerance.rmse, STEP_SHARE * tolerance.maximum)
    part = f"a quarter of the tolerance ({limit.text})"
    beyond = ""
    for voxels in _VOXELS:
        error = bench.error(voxels * voxel_mm)
        if error.rmse <= limit.rmse and error.maximum <= limit.maximum:
            return voxels, f"a sample of rays is off by {error.text}, within {part}{beyond}"
        beyond = f"; {_voxels(voxels)} would be off by {error.text}"
    return _VOXELS[-1], f"a sample of rays is off by {error.text}, more than {part}, but none finer is tried"


class _Bench:
    """Rays, and their light in truth."""

    def __init__(self, wishes: RenderWishes, functions: Sequence[TransferFunction], rays: PatchRays) -> None:
        self._segments = wishes.classification == "preintegrated"
        self._compositing = COMPOSITINGS[wishes.compositing]
        self._fine_mm = rays.step_mm
        self._cases: list[tuple[Table, Float64Array, Float64Array]] = []
        for table in map(Table.exact, functions):
            truth = self._truth(rays.values, table)
            seen = truth[:, 3] > _SEEN
            views = [np.flatnonzero(seen[view]) + view.start for view in rays.views]
            self._cases += [(table, rays.values.take(view, axis=1), truth[view]) for view in views if len(view)]

    def error(self, step_mm: float) -> PictureDifference:
        """Return the worst error of any function in any view, over the rays that show something."""
        light = self._segments_light if self._segments else self._samples_light
        found = [difference(light(rays, table, step_mm), truth) for table, rays, truth in self._cases]
        return worst(found) if found else PictureDifference(0.0, 0.0)

    def _truth(self, rays: Float64Array, table: Table) -> Float64Array:
        """Return the light of straight pieces between fine samples; where no such light is known, of the samples."""
        if "preintegrated" in self._compositing.classifications:
            return self._segments_light(rays, table, self._fine_mm)
        return self._compositing.rays(rays, self._fine_mm, table, "nearest")

    def _samples_light(self, rays: Float64Array, table: Table, step_mm: float) -> Float64Array:
        count, segment_mm = self._cut(rays, step_mm)
        ends = np.linspace(0.0, len(rays), count + 1)
        middles = _at(rays, (ends[:-1] + ends[1:]) / 2)
        return self._compositing.rays(middles, segment_mm, table, "nearest")

    def _segments_light(self, rays: Float64Array, table: Table, step_mm: float) -> Float64Array:
        pieces, piece_mm = self._cut(rays, step_mm)
        light = np.empty((rays.shape[1], 4))
        _native.straight_light(rays, pieces, piece_mm, *table.points, light)
        return light

    def _cut(self, rays: Float64Array, step_mm: float) -> tuple[int, float]:
        """Return how many equal segments, none longer than the step, rays are cut into; and their length."""
        length_mm = len(rays) * self._fine_mm
        count = max(1, int(np.ceil(length_mm / step_mm - 1e-3)))
        return count, length_mm / count


def _at(rays: Float64Array, places: Float64Array) -> Float64Array:
    """Return the values of rays [sample, ray] at places in samples from their ends, linear between two."""
    inside = np.clip(places - 0.5, 0.0, len(rays) - 1)
    lower = np.minimum(inside.astype(np.intp), max(len(rays) - 2, 0))
    share = (inside - lower)[:, None]
    values: Float64Array = rays[lower] + share * (rays[np.minimum(lower + 1, len(rays) - 1)] - rays[lower])
    return values
