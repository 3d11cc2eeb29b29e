"""The plan as a list for people: what is kept or left out, why, what it costs, and which files belong to it."""

import math
from collections.abc import Iterator

import numpy as np

from volprep.parts.bricks.decision import describe_bricks
from volprep.parts.classification.decision import describe_tables
from volprep.parts.levels.decision import by
from volprep.parts.mosaic.decision import describe_mosaic, mosaic_text
from volprep.parts.programs.decision import shader_files
from volprep.parts.subvolumes.decision import describe_subvolumes
from volprep.parts.texture.mipmaps import chain_bytes, describe_mipmaps
from volprep.parts.values.items import Grounds, describe_codes
from volprep.plan.functions import describe_functions
from volprep.plan.records import PREVIEW, ChannelPlan
from volprep.plan.room import Misfit, texture_bytes
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep_formats.package.manifest import PlanItem
from volprep_formats.textures.block_formats import BLOCKS

PREVIEW_ITEM = PlanItem(name="preview", kept=True, reason="a picture for people who browse packages", files=(PREVIEW,))
"""The picture that every package has."""


def describe(plan: ChannelPlan, grounds: Grounds) -> tuple[PlanItem, ...]:
    """List every decision. Each file of the package is named by exactly one item that is kept."""
    return (
        *describe_codes(plan, grounds.scene, grounds.values),
        *_levels(plan, grounds),
        *_layout(plan, grounds.scene),
        *describe_mipmaps(plan.levels, plan.volumes),
        *describe_bricks(plan.volumes, plan.profile),
        *describe_subvolumes(plan, grounds.scene),
        *describe_functions(grounds.scene, plan.transfer_functions),
        *describe_tables(plan, grounds.tables),
        _shaders(plan),
    )


def _levels(plan: ChannelPlan, grounds: Grounds) -> Iterator[PlanItem]:
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
        reason="shaders read only the codes; validation reads the source itself",
        size_bytes=math.prod(plan.grid.shape_zyx) * stored_bytes,
    )


def _layout(plan: ChannelPlan, scene: Scene) -> Iterator[PlanItem]:
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


def _why_flat(plan: ChannelPlan) -> str:
    if plan.profile.max_3d_texture_size:
        return "levels are compressed, and most devices have no compressed 3D textures"
    return f"profile {plan.profile.name} has no 3D textures"


def _shaders(plan: ChannelPlan) -> PlanItem:
    files = {path for program in plan.programs for path in shader_files(program)}
    technique = "3D texture" if plan.volumes[0].mosaic is None else "mosaic"
    technique = technique if plan.volumes[0].bricks is None else "bricks"
    walk = TECHNIQUES[plan.programs[0].technique].text
    return PlanItem(
        name="shaders",
        kept=True,
        reason=f"{walk} through the {technique}, one program for each transfer function",
        files=tuple(sorted(files)),
    )
