"""The plan as a list for people: what is kept or left out, why, what it costs, and the files it stands for."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from volprep.plan.bricks import describe_bricks
from volprep.plan.classification import Tables, describe_tables
from volprep.plan.functions import describe_functions
from volprep.plan.labels import label_reason
from volprep.plan.levels import by
from volprep.plan.mipmaps import chain_bytes, describe_mipmaps
from volprep.plan.mosaics import describe_mosaic, mosaic_text
from volprep.plan.records import LevelPlan, Plan, VolumePlan
from volprep.plan.room import Misfit, has_exact_16_bits, texture_bytes
from volprep.plan.subvolumes import describe_subvolumes
from volprep.plan.values import SHARE, ValueChoice, has_bits
from volprep.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.source import SourceInfo
from volprep_formats.textures.block_formats import BLOCKS

PREVIEW = "preview.png"
"""File of the preview picture."""


@dataclass(frozen=True)
class Grounds:
    """What the decisions rest on."""

    scene: Scene
    """What the user wants."""
    info: SourceInfo
    """What the source is."""
    values: ValueChoice
    """Codes, and what they cost."""
    candidates: list[LevelPlan]
    """Levels that there could be."""
    fits: list[VolumePlan | Misfit]
    """How the device class can hold each of them."""
    opacity: float
    """Bound on the opacity of any ray."""
    tables: Tables
    """What the package classifies with."""


def describe(plan: Plan, grounds: Grounds) -> tuple[PlanItem, ...]:
    """List every decision. Each file of the package is named by exactly one item that is kept."""
    return (
        *describe_border(plan, grounds),
        *describe_codes(plan, grounds),
        *_levels(plan, grounds),
        *_layout(plan, grounds.scene),
        *describe_mipmaps(plan.levels, plan.volumes),
        *describe_bricks(plan.volumes, plan.profile),
        *describe_subvolumes(plan.subvolumes, plan.grid, plan.levels, plan.volumes),
        *describe_functions(grounds.scene, plan.transfer_functions),
        *describe_tables(plan, grounds.tables),
        _shaders(plan),
        _ray_termination(plan, grounds),
        PlanItem(name="preview", kept=True, reason="a picture for people who browse packages", files=(PREVIEW,)),
    )


def describe_border(plan: Plan, grounds: Grounds) -> Iterator[PlanItem]:
    """Say whether an empty border was left out."""
    source = grounds.info.grid.shape_zyx
    cropped = math.prod(source) - math.prod(plan.grid.shape_zyx)
    stored_bytes = np.dtype(grounds.info.stored_type).itemsize
    if grounds.scene.crop == "none":
        yield PlanItem(name="empty border", kept=True, reason="the scene keeps the whole scan")
    elif cropped:
        yield PlanItem(
            name="empty border",
            kept=False,
            reason=f"no transfer function shows it; {by(plan.grid.shape_zyx)} of {by(source)} voxels remain",
            size_bytes=cropped * stored_bytes,
        )


def describe_codes(plan: Plan, grounds: Grounds) -> Iterator[PlanItem]:
    """Say how values become codes."""
    low, high = plan.quantize.window
    voxels = sum(math.prod(level.shape_zyx) for level in plan.levels)
    values = grounds.values
    tolerance = grounds.scene.tolerance
    change = f"they change the sample of rays by {values.error.text}"
    limit = f"half of the tolerance is {SHARE * tolerance.rmse:.2g} and {SHARE * tolerance.maximum:.2g}"
    exact = "every stored value of the source has a code of its own; " if values.exact else ""
    wide = PlanItem(
        name="16-bit values",
        kept=plan.quantize.bits == 16,
        reason=_why_not_wide(plan, grounds),
        size_bytes=voxels,
    )
    if plan.quantize.labels:
        yield PlanItem(
            name="labels",
            kept=True,
            reason=label_reason(plan.transfer_functions, plan.render.step_mm),
        )
    if plan.quantize.bits == 8:
        yield PlanItem(name="8-bit values", kept=True, reason=f"window {low:g} to {high:g}; {exact}{change}; {limit}")
        yield wide
        return
    reason = f"window {low:g} to {high:g}; {_why_wide(grounds)}; {_wide_texels(plan)}; {change}; {limit}"
    yield wide.model_copy(update={"reason": reason})


def _wide_texels(plan: Plan) -> str:
    if has_exact_16_bits(plan.profile):
        return "R16 texels hold codes as they are"
    return (
        f"profile {plan.profile.name} has no R16, and half floats move a value by up to 2^-12 of the window, 16 codes "
        "in place of half a code"
    )


def _why_wide(grounds: Grounds) -> str:
    if grounds.scene.editable:
        return "8 bits would not give every value a code, and users may edit transfer functions"
    narrow = grounds.values.narrow_error
    if narrow is not None:
        return f"8 bits would change the sample of rays by {narrow.text}"
    return "the scene asks for 16 bits" if grounds.scene.quantize.bits == 16 else "the profile has no narrower format"


def _why_not_wide(plan: Plan, grounds: Grounds) -> str:
    if plan.quantize.labels:
        return "labels have 8 bits"
    if grounds.scene.quantize.bits == 8:
        return "the scene asks for 8 bits"
    if not has_bits(plan.profile, 16):
        return f"profile {plan.profile.name} has no texture format for them"
    return "8 bits are enough"


def _levels(plan: Plan, grounds: Grounds) -> Iterator[PlanItem]:
    kept = {volume.level: volume for volume in plan.volumes}
    for level, fit in zip(grounds.candidates, grounds.fits, strict=True):
        shape = by(level.shape_zyx)
        name = f"level {level.index}"
        if level.index in kept:
            volume = kept[level.index]
            layout = "3D texture"
            if volume.mosaic is not None:
                layout = mosaic_text(volume.mosaic)
            if volume.bricks is not None:
                layout = f"3D texture of bricks, at most {by(volume.shape_zyx)} texels"
            if volume.mipmap:
                layout = f"mipmap of level {plan.volumes[0].level}"
            yield PlanItem(
                name=name,
                kept=True,
                reason=f"{shape} voxels as a {volume.format} {layout}",
                files=() if volume.mipmap else volume.files,
                size_bytes=0 if volume.mipmap else chain_bytes(plan.volumes, volume),
            )
            continue
        texel_bytes = plan.quantize.bits // 8
        reason = (
            fit.reason
            if isinstance(fit, Misfit)
            else f"level {max(k for k in kept if k < level.index)} fits and is finer"
        )
        yield PlanItem(name=name, kept=False, reason=reason, size_bytes=math.prod(level.shape_zyx) * texel_bytes)
    stored_bytes = np.dtype(grounds.info.stored_type).itemsize
    yield PlanItem(
        name="values of the source",
        kept=False,
        reason="shaders read the codes; validation reads the source itself",
        size_bytes=math.prod(plan.grid.shape_zyx) * stored_bytes,
    )


def _layout(plan: Plan, scene: Scene) -> Iterator[PlanItem]:
    finest = plan.volumes[0]
    size = texture_bytes(finest)
    if finest.mosaic is None:
        yield PlanItem(
            name="mosaic", kept=False, reason=f"profile {plan.profile.name} has 3D textures", size_bytes=size
        )
    else:
        yield PlanItem(
            name="3D texture",
            kept=False,
            reason=_why_flat(plan),
            size_bytes=math.prod(plan.levels[0].shape_zyx) * plan.quantize.bits // 8,
        )
        if finest.format in BLOCKS:
            return
        yield from describe_mosaic(finest.mosaic, plan.profile, scene.mosaic, finest.filter)


def _why_flat(plan: Plan) -> str:
    if plan.profile.max_3d_texture_size:
        return "levels are compressed, and most devices have no compressed 3D textures"
    return f"profile {plan.profile.name} has none"


def _shaders(plan: Plan) -> PlanItem:
    files = {path for program in plan.programs for path in (program.vertex, program.fragment)}
    technique = "3D texture" if plan.volumes[0].mosaic is None else "mosaic"
    technique = technique if plan.volumes[0].bricks is None else "bricks"
    return PlanItem(
        name="shaders",
        kept=True,
        reason=f"ray casting through the {technique}, one program for each transfer function",
        files=tuple(sorted(files)),
    )


def _ray_termination(plan: Plan, grounds: Grounds) -> PlanItem:
    wanted = grounds.scene.render.opacity_cutoff
    return PlanItem(
        name="early ray termination",
        kept=plan.render.opacity_cutoff is not None,
        reason=f"the most opaque values, along the whole diagonal, give opacity {grounds.opacity:.6g}; "
        f"the scene stops rays at {wanted:g}",
    )
