"""How far apart the samples of a ray are, for each level: as far as the error is a small part of the tolerance.

Level 0 is measured on rays of many views through the source (`parts/levels/view_rays.py`). Where only a sample of the
source is known, and for coarser levels, rays run through patches of it (`patch_rays`), or through their box means.
Steps of coarser levels are measured when these are made, on the level itself with its own table
(`parts/levels/level_steps.py`); where the whole source is known, a plan gives them the step of level 0 until then.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.parts.headlight import soft_slope
from volprep.parts.programs.patch_rays import PatchRays, patch_rays
from volprep.parts.programs.step_bench import FINER_VOXELS, LongestStep, StepBench, in_voxels, longest_step
from volprep.parts.values.labels import label_step_voxels
from volprep.plan.decisions import StepChoice
from volprep.plan.item_kinds import BEYOND
from volprep.plan.records import LevelPlan
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep.shading.slices import layer_target
from volprep.techniques import TECHNIQUES
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.segments.record import Border
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import LevelStep, PassTarget, RaySampling, TechniqueName
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo

LONGEST_AT_BORDERS: dict[Border, float] = {"mixed": 1.0, "crisp": 0.5}
"""Longest step in voxels where segments meet and rays have no labels. A crisp border is drawn within half a step of its
place, which rays do not measure."""

MARGIN_OF_VIEWS = 0.8
"""Part of the promise that the rays of views may take: the worst of 17 pictures had up to 1.3 times their error."""
_DOUBTFUL = 0.15
"""Lit steps shorter than so many voxels are measured again along finer samples: an eighth of a voxel is only two of the
samples that are the truth for it."""
_LONGEST_OF: dict[str, float] = {"colour": 0.5}
"""Longest step in voxels. Those of a volume in colour are measured on one channel: a stack of 20 × 36 × 32 voxels with
an opaque border was 0.0058 off with the step of 1 voxel that was chosen, and 0.0018 with half of it."""


def choose_steps(
    scene: Scene,
    functions: Sequence[TransferFunction],
    info: SourceInfo,
    measured: Measured,
    *,
    grid: Grid,
    levels: Sequence[LevelPlan],
    in_pieces: Sequence[LevelPlan] = (),
    layers: PassTarget | None = None,
    finest: Sequence[PatchRays] = (),
    finer: Callable[[], Sequence[PatchRays]] | None = None,
) -> tuple[StepChoice, ...]:
    """Choose the step of each level of a channel; `grid` is that of level 0, a part of the source's.

    `in_pieces` are levels that the package holds in sub-volumes only. `layers` is the result of `layers_of`. `finest`
    are rays of views through level 0, if the whole source is known, and `finer` samples them more finely.
    """
    wanted = scene.render.step_voxels
    technique = TECHNIQUES[scene.render.technique]
    usual = technique.step_voxels or COMPOSITINGS[scene.render.compositing].step_voxels
    chosen: list[StepChoice] = []
    of_finest: float | None = None
    for level in (*in_pieces, *levels):
        voxel_mm = min(f * h for f, h in zip(level.factors_zyx, grid.spacing_mm_zyx, strict=True))
        is_beyond = False
        if wanted != "auto":
            voxels, reason = wanted, "as the scene states"
        elif scene.source.labels:
            voxels, reason = label_step_voxels(scene.render, functions, voxel_mm, scene.tolerance)
        elif technique.step_voxels is not None:
            voxels, reason = usual, f"technique {scene.render.technique} converges to another picture"
        elif COMPOSITINGS[scene.render.compositing].cell_by_cell:
            voxels, reason = usual, "rays go from cell to cell, so that no step of up to a voxel makes an error"
        elif COMPOSITINGS[scene.render.compositing].isovalue:
            voxels, reason = usual, "a few rays do not tell where longer steps miss a surface"
        elif scene.editable:
            voxels, reason = usual, "users may edit the functions that it would be measured with"
        elif level.index > 0 and finest and of_finest is not None:
            voxels, reason = of_finest, "as level 0, until the RMSE of steps is measured on the level, when it is made"
        else:
            of_views = finest if level.index == 0 else ()
            rays = of_views or [source_rays(scene, info, measured, grid, level.factors_zyx)]
            measure = partial(_measured, scene, functions, layers, voxel_mm)
            voxels, reason, _, is_beyond = measure(rays, finer) if of_views else measure(rays)
            of_finest = voxels if level.index == 0 else of_finest
            if level.index == 0 and not of_views:
                reason = f"{reason}; an estimate along rays through parts of the scan; a build measures all of it"
            border = None if scene.segments is None else scene.segments.border
            is_measured = border == "mixed" and any(ray.looks is not None for ray in rays)
            if border is not None and not is_measured and voxels > LONGEST_AT_BORDERS[border]:
                voxels = LONGEST_AT_BORDERS[border]
                reason = f"borders of segments, {border}, need samples as close as that"
            longest = _LONGEST_OF.get(scene.render.classification, voxels)
            if voxels > longest:
                voxels = longest
                reason = "light and extinction were measured one by one, and the picture needs both"
        text = f"{in_voxels(voxels)}: {reason}"
        choice = StepChoice(level.index, voxels * voxel_mm, text, in_pieces=level in in_pieces, is_beyond=is_beyond)
        chosen.append(choice)
    return tuple(chosen)


def _measured(  # noqa: PLR0917 - what is drawn, and the rays
    scene: Scene,
    functions: Sequence[TransferFunction],
    layers: PassTarget | None,
    voxel_mm: float,
    rays: Sequence[PatchRays],
    finer: Callable[[], Sequence[PatchRays]] | None = None,
) -> LongestStep:
    """Return the longest step along rays; `finer` samples them more finely, if they are rays of views."""
    compositing = COMPOSITINGS[scene.render.compositing]
    bench = partial(
        StepBench,
        compositing,
        [Table.exact(function) for function in functions],
        is_segments=scene.render.classification == "preintegrated",
        layers=layers,
    )
    usual, margin = compositing.step_voxels, 1.0 if finer is None else MARGIN_OF_VIEWS
    found = longest_step(bench(rays), voxel_mm, scene.tolerance, usual, margin)
    if finer is None or scene.render.lighting == "none" or found.voxels >= _DOUBTFUL:
        return found
    return longest_step(bench(finer()), voxel_mm, scene.tolerance, usual, margin, tried_voxels=FINER_VOXELS)


def source_rays(
    scene: Scene, info: SourceInfo, measured: Measured, grid: Grid, factors_zyx: tuple[int, int, int] = (1, 1, 1)
) -> PatchRays:
    """Return rays through patches of the source, or through their box means; `grid` is that of level 0."""
    patches = np.stack([_reduced(patch, factors_zyx) for patch in measured.stored_patches])
    patches *= info.slope
    patches += info.intercept
    z, y, x = (f * h for f, h in zip(factors_zyx, grid.spacing_mm_zyx, strict=True))
    length_mm = float(np.mean(grid.extent_mm_zyx))
    soft_per_mm = None
    if scene.render.lighting != "none":
        values_range = measured.statistics.maximum - measured.statistics.minimum
        soft_per_mm = soft_slope(scene.lighting.normals) * values_range / min(grid.spacing_mm_zyx)
    return patch_rays(patches, (z, y, x), length_mm, soft_per_mm=soft_per_mm)


def layers_of(technique: TechniqueName, profile: DeviceProfile) -> PassTarget | None:
    """Return the format of the picture that a technique blends layers in; None if it casts rays."""
    return layer_target(profile.dialect) if TECHNIQUES[technique].blends else None


def measures_steps(scene: Scene) -> bool:
    """Return whether the steps of coarser levels are measured on the levels, when these are made."""
    return scene.render.step_voxels == "auto" and has_error_of_steps(scene)


def has_error_of_steps(scene: Scene) -> bool:
    """Return whether rays of the scan tell which error a step makes."""
    return (
        not scene.source.labels
        and not scene.editable
        and TECHNIQUES[scene.render.technique].step_voxels is None
        and not COMPOSITINGS[scene.render.compositing].cell_by_cell
        and not COMPOSITINGS[scene.render.compositing].isovalue
        and scene.render.classification not in {"preclassified", "colour"}
    )


def common_steps(channels: Sequence[Sequence[StepChoice]]) -> RaySampling:
    """Return for each level the finest step that any channel needs."""
    by_level: dict[int, float] = {}
    choices = [choice for channel in channels for choice in channel]
    for choice in choices:
        by_level[choice.level] = min(choice.step_mm, by_level.get(choice.level, choice.step_mm))
    step_mm = by_level[min(choice.level for choice in choices if not choice.in_pieces)]
    others = (
        LevelStep(level=level, step_mm=by_level[level]) for level in sorted(by_level) if by_level[level] != step_mm
    )
    return RaySampling(step_mm=step_mm, level_steps=tuple(others))


def describe_steps(rays: RaySampling, choices: Sequence[StepChoice]) -> Iterator[PlanItem]:
    """Say for each level of a channel how far apart samples are, and why."""
    for choice in choices:
        step_mm = rays.step_of(choice.level)
        shared = "" if step_mm == choice.step_mm else f"; here {step_mm:.3g} mm, for another channel"
        reason = f"{choice.step_mm:.3g} mm, {choice.reason}{shared}"
        yield PlanItem(name=f"step of level {choice.level}", kind="step", level=choice.level, kept=True, reason=reason)
    finest = next((choice for choice in choices if not choice.in_pieces), None)
    if finest is not None and finest.is_beyond:
        yield PlanItem(
            name="error of steps",
            kind=BEYOND,
            level=finest.level,
            kept=True,
            reason=f"steps of level {finest.level} are beyond the tolerance: {finest.reason}; validate will find "
            "pictures beyond it, unless the scene allows more in [tolerance] or has smoother transfer functions",
        )


def _reduced(patch: NDArray[np.generic], factors_zyx: tuple[int, int, int]) -> Float64Array:
    """Return means of blocks of voxels of a patch; at the end of an axis the last voxel is repeated."""
    means: Float64Array = patch.astype(np.float64)
    # Axis by axis: a patch is as deep as the volume, and cells may be wider than a patch.
    for axis, factor in enumerate(factors_zyx):
        missing = [(0, -n % factor if value == axis else 0) for value, n in enumerate(means.shape)]
        padded = np.pad(means, missing, mode="edge")
        shape = padded.shape
        means = padded.reshape(*shape[:axis], -1, factor, *shape[axis + 1 :]).mean(axis=axis + 1)
    return means
