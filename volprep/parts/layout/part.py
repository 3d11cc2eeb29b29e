"""The part *layout*: which levels a package holds, and the textures that hold them."""

import math
from collections.abc import Iterator

import numpy as np

from volprep.parts.bricks.flat import index_zyx
from volprep.parts.case import Case
from volprep.parts.layout.decision import lay_out
from volprep.parts.mosaic.decision import describe_mosaic, mosaic_text
from volprep.parts.part import Part, PlannedImage
from volprep.parts.texture.mipmaps import chain_bytes
from volprep.plan.decisions import CompressionChoice, Layout
from volprep.plan.item_kinds import LEVEL
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.plan.room import Misfit, texture_bytes
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.textures.block_formats import BLOCKS

_PLACES = ("first", "second", "third", "fourth")


def describe_levels(plan: ChannelPlan, case: Case, layout: Layout) -> Iterator[PlanItem]:
    """List the levels that the package holds, and the ones it leaves out."""
    kept = {volume.level: volume for volume in plan.volumes}
    for level, fit in zip(layout.candidates, layout.fits, strict=True):
        item = PlanItem(name=f"level {level.index}", kind=LEVEL, level=level.index, kept=level.index in kept, reason="")
        if level.index in kept:
            yield item.model_copy(update=_held(plan, kept[level.index]))
            continue
        texel_bytes = plan.quantize.bits // 8
        reason = (
            fit.reason
            if isinstance(fit, Misfit)
            else f"level {max(k for k in kept if k < level.index)} fits and is finer"
        )
        yield item.model_copy(update={"reason": reason, "size_bytes": math.prod(level.shape_zyx) * texel_bytes})
    stored_bytes = np.dtype(case.info.stored_type).itemsize
    yield PlanItem(
        name="values of the source",
        kind="source-values",
        kept=False,
        reason="shaders read only the codes; validation reads the source itself",
        size_bytes=math.prod(plan.grid.shape_zyx) * stored_bytes,
    )


def _held(plan: ChannelPlan, volume: VolumePlan) -> dict[str, object]:
    """Return reason, files and size of the item of a level that the package holds."""
    shape = shape_text(plan.level(volume.level).shape_zyx)
    if len(volume.channels) > 1:
        # The item of the channels that share texels has the files.
        place = _PLACES[volume.channels.index(plan.channel)]
        return {"reason": f"{shape} voxels in the {place} component of {', '.join(volume.names)}"}
    if volume.mipmap:
        return {"reason": f"{shape} voxels as a {volume.format} mipmap of level {plan.volumes[0].level}"}
    layout = "3D texture"
    if volume.mosaic is not None:
        layout = mosaic_text(volume.mosaic)
    if volume.bricks is not None:
        form = "3D texture" if volume.mosaic is None else "mosaic"
        layout = f"{form} of bricks, at most {shape_text(volume.shape_zyx)} texels"
    return {
        "reason": f"{shape} voxels as a {volume.format} {layout}",
        "files": volume.files,
        "size_bytes": chain_bytes(plan.volumes, volume),
    }


def describe_layout(plan: ChannelPlan, scene: Scene) -> Iterator[PlanItem]:
    """Say why levels are mosaics or 3D textures."""
    finest = plan.volumes[0]
    if finest.mosaic is None:
        reason = f"profile {plan.profile.name} has 3D textures"
        size = texture_bytes(finest) // len(finest.channels)
        yield PlanItem(name="mosaic", kind="mosaic", kept=False, reason=reason, size_bytes=size)
        return
    yield PlanItem(
        name="3D texture",
        kind="texture-3d",
        kept=False,
        reason=_why_flat(plan),
        size_bytes=math.prod(plan.levels[0].shape_zyx) * plan.quantize.bits // 8,
    )
    if finest.format not in BLOCKS and len(finest.channels) == 1 and finest.bricks is None:
        yield from describe_mosaic(finest.mosaic, plan.profile, scene.mosaic, finest.filter)


def _why_flat(plan: ChannelPlan) -> str:
    if plan.profile.max_3d_texture_size:
        return "levels are compressed, and most devices have no compressed 3D textures"
    return f"profile {plan.profile.name} has no 3D textures"


def _plan(case: Case) -> Case:
    return case.plus(lay_out(case, case.decided(CompressionChoice).form))


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    yield from describe_levels(plan, case, case.layout)
    yield from describe_layout(plan, case.scene)


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    for drawn in plan.volumes:
        # All mipmaps of a texture are uploaded with it.
        for held in plan.volumes:
            if not set(drawn.files).isdisjoint(held.files):
                for file in held.files:
                    name = f"{file} {held.mipmap or 0}"
                    yield PlannedImage(name, held.format, held.shape_zyx, drawn.transfer, drawn.level)
        if drawn.bricks is not None:
            # The texture of the places of bricks is as large as it is if no brick is empty.
            shape_zyx = index_zyx(plan.level(drawn.level).shape_zyx, drawn.bricks.size, plan.profile)
            yield PlannedImage(drawn.bricks.file, "rgba8unorm", shape_zyx, drawn.transfer, drawn.level)


PART = Part(name="layout", plan=_plan, items=_items, images=_images)
