"""Make the plan of a package: what its channels have in common is decided once, the rest for each.

All channels have one crop, because they have one box, and one step and one early end of rays.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from volprep.compositing import COMPOSITINGS
from volprep.parts.channel_rays import with_rays
from volprep.parts.channel_scan import ChannelScan
from volprep.parts.classification.automatic import (
    ClassificationChoice,
    ScanRays,
    choose_classification,
    describe_classification,
    possible_kinds,
)
from volprep.parts.programs.early_end import describe_early_end
from volprep.parts.registry import PARTS
from volprep.parts.segments.decision import used_functions
from volprep.parts.segments.extent import style_boxes
from volprep.parts.together.decision import plan_together
from volprep.parts.values.items import describe_border
from volprep.pipeline.channel_plan import valued
from volprep.pipeline.costs import planned_costs
from volprep.pipeline.layout import lay_channels_out
from volprep.pipeline.stage_graph import planned_stages
from volprep.plan.crop import choose_crop
from volprep.plan.decisions import ValueChoice
from volprep.plan.functions import resolved_functions
from volprep.plan.hybrid import describe_hybrid
from volprep.plan.item_kinds import FIRST_LOOK
from volprep.plan.item_kinds import PREVIEW as PREVIEW_KIND
from volprep.plan.records import PREVIEW, ChannelPlan, CropPlan, Plan
from volprep.plan.whole_source import WholeSource
from volprep.scan.segments.record import FoundSegments
from volprep.scan.slabs import RawVolume
from volprep.scan.statistics import Measured
from volprep.scene.channels import drawn_channels, left_out
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ClassificationName
from volprep_formats.source import SourceInfo

_PREVIEW = PlanItem(
    name="preview",
    kind=PREVIEW_KIND,
    kept=True,
    reason="a thumbnail for people who browse packages",
    files=(PREVIEW,),
)


@dataclass(frozen=True)
class Scanned:
    """Facts about the source of a channel."""

    info: SourceInfo
    """Description of the source."""
    measured: Measured
    """Measurements of the source."""
    whole: WholeSource | None = None
    """The source itself, where it has been imported. Without it compression is decided by a sample of it."""
    voxels: RawVolume | None = None
    """Its stored values, if known; without them the step of level 0 is decided by a sample."""


def make_plan(
    scene: Scene,
    profile: DeviceProfile,
    scanned: Sequence[Scanned],
    segments: FoundSegments | None = None,
    labels: RawVolume | None = None,
) -> Plan:
    """Decide everything for the channels that are drawn, in the order of `drawn_channels`.

    `labels` are the labels of `segments` on the grid of the source, if known: steps are measured with them.

    Raises the errors of parts, of `begin` and of `valued`, VP1244 for parts that do not support several
    channels, VP3031 and VP3032 for impossible bricks, VP3166 for an unnecessary estimate of opacity, VP3060 for
    unnecessary slices, VP3080 for parts that do not allow editing of transfer functions.
    """
    wanted = scene.render.classification
    kinds = possible_kinds(scene, lambda each: _prepared(each, profile, len(scanned)))
    scene = _prepared(scene.with_classification(kinds[0]), profile, len(scanned))
    scans = [replace(scan, labels=labels) for scan in _channel_scans(scene, scanned, segments)]
    crop = _common_crop(scene, scans)
    grid = scanned[0].info.grid.part(crop.start_zyx, crop.stop_zyx)
    for scan in scans:
        for part in PARTS:
            part.require_scan(scan.scene, grid, scan.functions, scan.measured)
    values = [valued(scan, profile) for scan in scans]
    scans = [with_rays(scan, crop, grid, profile) for scan in scans]
    classified = None
    if wanted == "auto":
        classified = _classification(scans, values, profile, kinds, grid)
        scene = scene.with_classification(classified.name)
        scans = [replace(scan, scene=scan.scene.with_classification(classified.name)) for scan in scans]
    laid_out, blocks = lay_channels_out(scene, scans, values, profile, crop, grid)
    shared, packed, early_end = laid_out.shared, laid_out.packed, laid_out.early_end
    channels = laid_out.channels
    channels[0] = channels[0].model_copy(update={"forms": (*channels[0].forms, *blocks.forms)})
    measured = [each.measured for each in scanned]
    together, of_picture = plan_together(channels, measured, laid_out.together, packed, scene)
    items = [
        *_describe_look(scene),
        *describe_classification(classified),
        *describe_border(shared, scene, scanned[0].info),
        *_of_channels(channels, [each.items(plan) for plan, each in zip(channels, laid_out.finished, strict=True)]),
        *packed.items,
        *blocks.items,
        *of_picture,
        *([describe_early_end(early_end, shared.rays.opacity_cutoff, scene)] if profile.has_shaders else []),
        *describe_hybrid(shared.render.hybrid),
        _PREVIEW,
        *_left_out(scene, channels[0]),
    ]
    plan = Plan(
        shared=shared,
        channels=tuple(channels),
        together=together,
        fidelity=scene.fidelity,
        stages=(),
        items=tuple(items),
    )
    return plan.model_copy(update={"stages": planned_stages(plan), "costs": planned_costs(plan)})


def _prepared(scene: Scene, profile: DeviceProfile, channels: int) -> Scene:
    """Return the scene with the settings that parts need. Raises the errors of parts, and as `_require_possible`."""
    for part in PARTS:
        scene = part.prepare(scene, profile, channels)
    _require_possible(scene, profile, channels)
    return scene


def _classification(
    scans: Sequence[ChannelScan],
    values: Sequence[ValueChoice],
    profile: DeviceProfile,
    kinds: Sequence[ClassificationName],
    grid: Grid,
) -> ClassificationChoice:
    """Choose how values become colours; all channels have the same way."""
    rays = [
        ScanRays(scan.info, scan.measured, scan.functions, found, grid, scan.finest)
        for scan, found in zip(scans, values, strict=True)
    ]
    return choose_classification(scans[0].scene, profile, kinds, rays)


def _require_possible(scene: Scene, profile: DeviceProfile, channels: int) -> None:
    """Raise if the scene wants what the device class, or a volume of so many channels, cannot have."""
    if channels > 1 and not profile.has_shaders:
        raise VolprepError("VP1244", path=scene.name, what="stacks of slices")
    if channels > 1 and scene.render.classification == "preclassified":
        raise VolprepError("VP1244", path=scene.name, what="voxels that are classified")
    for part in PARTS:
        part.require(scene, profile)


def _channel_scans(scene: Scene, scanned: Sequence[Scanned], segments: FoundSegments | None) -> list[ChannelScan]:
    scans = []
    for channel, found in zip(drawn_channels(scene), scanned, strict=True):
        own = scene.with_source(channel.spec).with_transfer(channel.transfer)
        functions = used_functions(own, segments, resolved_functions(own, found.info, found.measured))
        scans.append(
            ChannelScan(channel.name, own, found.info, found.measured, functions, found.whole, segments, found.voxels)
        )
    return scans


def _common_crop(scene: Scene, scans: Sequence[ChannelScan]) -> CropPlan:
    """Return the smallest box that holds what each channel shows."""
    shown = COMPOSITINGS[scene.render.compositing].visible_table
    # Not for normals that nothing lights by: the verb that adds them to a draft would have to begin again.
    reach = 0 if scene.render.lighting == "none" else 1
    crops = []
    for scan in scans:
        boxes = style_boxes(scan.scene, scan.segments)
        crops.append(
            choose_crop(
                scene.crop,
                [shown(Table.exact(each)) for each in scan.functions],
                scan.measured.ranges_zyx,
                reach=reach,
                boxes=[boxes.get(each.name) for each in scan.functions],
            )
        )
    z0, y0, x0 = (min(crop.start_zyx[axis] for crop in crops) for axis in range(3))
    z1, y1, x1 = (max(crop.stop_zyx[axis] for crop in crops) for axis in range(3))
    return CropPlan(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def _of_channels(plans: Sequence[ChannelPlan], items: Sequence[Sequence[PlanItem]]) -> list[PlanItem]:
    """List the decisions about each channel, with its name.

    Raises VP1244 for an item of two channels that would be the same file; only shaders may be.
    """
    listed: list[PlanItem] = []
    claimed: set[str] = set()
    for plan, each in zip(plans, items, strict=True):
        for item in each:
            files = tuple(path for path in item.files if path not in claimed)
            if any(path in claimed and not path.startswith("shaders/") for path in item.files):
                raise VolprepError("VP1244", path=plan.channel, what=item.name)
            claimed |= set(files)
            listed.append(item.model_copy(update={"channel": plan.channel, "files": files}))
    return listed


def _describe_look(scene: Scene) -> list[PlanItem]:
    """Return the kind that a scan without a scene was recognised as."""
    return (
        [PlanItem(name="first look", kind=FIRST_LOOK, kept=True, reason=scene.recognised)] if scene.recognised else []
    )


def _left_out(scene: Scene, plan: ChannelPlan) -> list[PlanItem]:
    voxels = sum(math.prod(level.shape_zyx) for level in plan.levels)
    size = voxels * plan.quantize.bits // 8
    reason = "no transfer function is for it"
    return [
        PlanItem(name="channel", kind="channel", channel=name, kept=False, reason=reason, size_bytes=size)
        for name in left_out(scene)
    ]
