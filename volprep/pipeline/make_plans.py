"""The plan of a volume of several channels: that of each for itself, with what they share decided once.

All have the same crop, because they have one box, and the same step and early end of rays, which a package says once.
"""

import math
from collections.abc import Sequence
from typing import TypeVar

from volprep.parts.compression.whole import WholeSource
from volprep.parts.editing.decision import for_edits
from volprep.parts.together.decision import choose_together, plan_together
from volprep.parts.together.packing import pack_channels
from volprep.pipeline.make_plan import Common, make_plan
from volprep.plan.crop import choose_crop
from volprep.plan.functions import resolved_functions
from volprep.plan.products import BlockRangesPlan, NormalTexturePlan
from volprep.plan.records import CropPlan, Plan, VolumePlan
from volprep.scan.statistics import Measured
from volprep.scene.channels import drawn_channels, left_out
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.source import SourceInfo

_Parts = TypeVar("_Parts", VolumePlan, NormalTexturePlan)
_OF_ALL = frozenset(("preview", "empty border", "early ray termination"))


def make_plans(
    scene: Scene,
    profile: DeviceProfile,
    infos: Sequence[SourceInfo],
    measured: Sequence[Measured],
    wholes: Sequence[WholeSource] | None = None,
) -> Plan:
    """Decide everything for the channels that are drawn, in the order of `drawn_channels`; the first has the others.

    `wholes` are their sources, where they have been imported; compression is decided on them.

    Raises what `make_plan` raises, and VP1244 for what cannot be made of several channels.
    """
    drawn = drawn_channels(scene)
    if len(infos) == 1:
        alone = scene.model_copy(update={"source": drawn[0].spec})
        plan = make_plan(alone, profile, infos[0], measured[0], whole=wholes[0] if wholes else None)
        return plan.model_copy(update={"items": (*plan.items, *_left_out(scene, plan))})
    if not profile.has_shaders:
        raise VolprepError("VP1244", path=scene.name, what="stacks of slices")
    if scene.render.classification == "preclassified":
        raise VolprepError("VP1244", path=scene.name, what="voxels that are classified")
    scenes = [scene.model_copy(update={"transfer": channel.transfer, "source": channel.spec}) for channel in drawn]
    channels = list(zip(scenes, infos, measured, strict=True))
    sources: Sequence[WholeSource | None] = wholes or [None] * len(channels)
    crop = _common_crop(channels, profile)

    def made(common: Common) -> list[Plan]:
        return [
            make_plan(scene, profile, info, found, common, whole)
            for (scene, info, found), whole in zip(channels, sources, strict=True)
        ]

    plans = made(Common(crop))
    cutoffs = {plan.render.opacity_cutoff for plan in plans}
    steps_mm = {plan.render.step_mm for plan in plans}
    if len(cutoffs) > 1 or len(steps_mm) > 1:
        common = Common(crop, min(steps_mm), cutoff=len(cutoffs) > 1 or None not in cutoffs)
        plans = made(common)
    stages = tuple(dict.fromkeys(stage for plan in plans for stage in plan.stages))
    named = [_named(plan, channel.name, stages) for plan, channel in zip(plans, drawn, strict=True)]
    drawn_together = choose_together(named, measured, scene)
    named, packing = pack_channels(named, scene, [*drawn_together.transfers])
    together, of_picture = plan_together(named, measured, drawn_together, packing, scene)
    items = (*_items(named), packing, *of_picture, *_left_out(scene, named[0]))
    if together is not None and together.skip_tables and "skip" not in stages:
        named = [plan.model_copy(update={"stages": (*stages[:-2], "skip", *stages[-2:])}) for plan in named]
    return named[0].model_copy(update={"together": together, "others": tuple(named[1:]), "items": items})


def _common_crop(channels: Sequence[tuple[Scene, SourceInfo, Measured]], profile: DeviceProfile) -> CropPlan:
    """Return the smallest box that holds what each channel shows."""
    crops = [
        choose_crop(for_edits(scene, profile).crop, resolved_functions(scene, info, found), found.ranges_zyx)
        for scene, info, found in channels
    ]
    z0, y0, x0 = (min(crop.start_zyx[axis] for crop in crops) for axis in range(3))
    z1, y1, x1 = (max(crop.stop_zyx[axis] for crop in crops) for axis in range(3))
    return CropPlan(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def _named(plan: Plan, channel: str, stages: tuple[str, ...]) -> Plan:
    """Return the plan of a channel names of its own for what does not belong to a transfer function."""
    volumes = tuple(_parts_of_channel(volume, channel) for volume in plan.volumes)
    forms = tuple(form.model_copy(update={"channel": channel}) for form in plan.forms)
    changes: dict[str, object] = {"channel": channel, "volumes": volumes, "stages": stages, "forms": forms}
    before: list[str] = [file for volume in plan.volumes for file in volume.files]
    after: list[str] = [file for volume in volumes for file in volume.files]
    if plan.skip is not None:
        ranges = tuple(_of_channel(each, channel) for each in plan.skip.ranges)
        changes["skip"] = plan.skip.model_copy(update={"ranges": ranges})
        before += [each.file for each in plan.skip.ranges]
        after += [each.file for each in ranges]
    if plan.normals is not None:
        textures = tuple(_parts_of_channel(each, channel) for each in plan.normals.textures)
        changes["normals"] = plan.normals.model_copy(update={"textures": textures})
        before += [file for each in plan.normals.textures for file in each.files]
        after += [file for each in textures for file in each.files]
    if plan.editing is not None:
        histograms = tuple(
            each.model_copy(update={"file": f"{each.file.removesuffix('.bin')}-{channel}.bin"})
            for each in plan.editing.histograms
        )
        changes["editing"] = plan.editing.model_copy(update={"histograms": histograms})
        before += [each.file for each in plan.editing.histograms]
        after += [each.file for each in histograms]
    files = dict(zip(before, after, strict=True))
    changes["items"] = tuple(
        item.model_copy(update={"files": tuple(files.get(path, path) for path in item.files)}) for item in plan.items
    )
    return plan.model_copy(update=changes)


def _parts_of_channel(textures: _Parts, channel: str) -> _Parts:
    names = tuple(f"{name}-{channel}" for name in textures.names)
    files = tuple(_file(file, channel) for file in textures.files)
    return textures.model_copy(update={"names": names, "files": files})


def _of_channel(texture: BlockRangesPlan, channel: str) -> BlockRangesPlan:
    return texture.model_copy(update={"name": f"{texture.name}-{channel}", "file": _file(texture.file, channel)})


def _file(file: str, channel: str) -> str:
    return f"{file.removesuffix('.ktx2')}-{channel}.ktx2"


def _items(plans: Sequence[Plan]) -> tuple[PlanItem, ...]:
    """List the decisions about each channel under its name, and those about all of them once.

    Raises VP1244 for an item of two channels that would be the same file; only shaders may be.
    """
    items: list[PlanItem] = []
    claimed: set[str] = set()
    for plan in plans:
        for item in plan.items:
            if item.name in _OF_ALL:
                continue
            files = tuple(path for path in item.files if path not in claimed)
            if any(path in claimed and not path.startswith("shaders/") for path in item.files):
                raise VolprepError("VP1244", path=plan.channel, what=item.name)
            claimed |= set(files)
            items.append(item.model_copy(update={"name": f"{plan.channel}: {item.name}", "files": files}))
    items += [item for item in plans[0].items if item.name in _OF_ALL]
    return tuple(items)


def _left_out(scene: Scene, plan: Plan) -> tuple[PlanItem, ...]:
    voxels = sum(math.prod(level.shape_zyx) for level in plan.levels)
    return tuple(
        PlanItem(
            name=f"channel {name}",
            kept=False,
            reason="no transfer function is for it",
            size_bytes=voxels * plan.quantize.bits // 8,
        )
        for name in left_out(scene)
    )
