"""Make the plan of a package: what its channels have in common is decided once, the rest for each.

All channels have one crop, because they have one box, and one step and one early end of rays.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from volprep.compositing import COMPOSITINGS
from volprep.parts.bricks.decision import require_bricks
from volprep.parts.classification.decision import require_classification
from volprep.parts.compression.whole import WholeSource
from volprep.parts.editing.decision import for_edits
from volprep.parts.hybrid.decision import describe_hybrid, plan_hybrid
from volprep.parts.programs.decision import require_light_outside, require_shadows, require_technique, sampling_of
from volprep.parts.programs.early_end import describe_early_end, most
from volprep.parts.programs.step import common_steps
from volprep.parts.slices.decision import refuse_slices
from volprep.parts.together.decision import choose_together, plan_together
from volprep.parts.together.packing import pack_channels
from volprep.parts.values.items import describe_border
from volprep.parts.values.labels import require_distinct_labels
from volprep.pipeline.channel_plan import Begun, ChannelScan, begin
from volprep.pipeline.costs import planned_costs
from volprep.pipeline.items import PREVIEW_ITEM
from volprep.plan.crop import choose_crop
from volprep.plan.functions import resolved_functions
from volprep.plan.products import TogetherPlan
from volprep.plan.records import ChannelPlan, CropPlan, Plan, Shared
from volprep.scan.statistics import Measured
from volprep.scene.channels import drawn_channels, left_out
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem, RenderSettings
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.source import SourceInfo


@dataclass(frozen=True)
class Scanned:
    """What is known of the source of a channel."""

    info: SourceInfo
    """What it is."""
    measured: Measured
    """What was measured of it."""
    whole: WholeSource | None = None
    """The source itself, where it has been imported. Without it compression is decided by a sample of it."""


def make_plan(scene: Scene, profile: DeviceProfile, scanned: Sequence[Scanned]) -> Plan:
    """Decide everything for the channels that are drawn, in the order of `drawn_channels`.

    Raises what `begin` raises, VP1244 for what cannot be made of several channels, VP3031 and VP3032 for bricks that
    cannot be, VP3166 for an estimate of opacity that nobody needs, VP3043 for one that mixes labels, VP3060 for
    slices without need, VP3080 for what cannot be had where functions may be edited.
    """
    scene = for_edits(scene, profile)
    _require_possible(scene, profile, len(scanned))
    scans = _channel_scans(scene, scanned)
    crop = _common_crop(scene, scans)
    grid = scanned[0].info.grid.part(crop.start_zyx, crop.stop_zyx)
    require_light_outside(scene, grid)
    begun = [begin(scan, profile, crop, grid) for scan in scans]
    early_end = most([each.early_end for each in begun])
    shared = Shared(
        profile=profile,
        crop=crop,
        grid=grid,
        render=_render(scene, profile, begun, early_end.cutoff(scene)),
        compositing=scene.render.compositing,
    )
    finished = [channel.finished(shared) for channel in begun]
    channels = [plan for plan, _ in finished]
    measured = [each.measured for each in scanned]
    drawn_together = choose_together(channels, measured, scene)
    packed = pack_channels(channels, scene, [*drawn_together.transfers])
    channels = [packed.plan(plan) for plan in channels]
    together, of_picture = plan_together(channels, measured, drawn_together, packed, scene)
    items = [
        *describe_border(shared, scene, scanned[0].info),
        *_of_channels(channels, [packed.described(plan, items) for plan, items in finished]),
        *packed.items,
        *of_picture,
        *([describe_early_end(early_end, shared.render.opacity_cutoff, scene)] if profile.has_shaders else []),
        *describe_hybrid(shared.render.hybrid),
        PREVIEW_ITEM,
        *_left_out(scene, channels[0]),
    ]
    plan = Plan(
        shared=shared,
        channels=tuple(channels),
        together=together,
        fidelity=scene.fidelity,
        stages=_stages(channels, together),
        items=tuple(items),
    )
    return plan.model_copy(update={"costs": planned_costs(plan)})


def _require_possible(scene: Scene, profile: DeviceProfile, channels: int) -> None:
    """Raise if the scene wants what the device class, or a volume of so many channels, cannot have."""
    if channels > 1 and not profile.has_shaders:
        raise VolprepError("VP1244", path=scene.name, what="stacks of slices")
    if channels > 1 and scene.render.classification == "preclassified":
        raise VolprepError("VP1244", path=scene.name, what="voxels that are classified")
    require_shadows(scene, profile)
    if profile.has_shaders:
        refuse_slices(scene, profile)
        require_technique(scene, profile)
        require_classification(scene)
        require_bricks(scene, profile)


def _channel_scans(scene: Scene, scanned: Sequence[Scanned]) -> list[ChannelScan]:
    scans = []
    for channel, found in zip(drawn_channels(scene), scanned, strict=True):
        own = scene.with_source(channel.spec).with_transfer(channel.transfer)
        require_distinct_labels(own)
        functions = resolved_functions(own, found.info, found.measured)
        scans.append(ChannelScan(channel.name, own, found.info, found.measured, functions, found.whole))
    return scans


def _common_crop(scene: Scene, scans: Sequence[ChannelScan]) -> CropPlan:
    """Return the smallest box that holds what each channel shows."""
    shown = COMPOSITINGS[scene.render.compositing].visible_table
    # Not for normals that nothing lights by: the verb that adds them to a draft would have to begin again.
    reach = 0 if scene.render.lighting == "none" else 1
    crops = [
        choose_crop(
            scene.crop, [shown(Table.exact(each)) for each in scan.functions], scan.measured.ranges_zyx, reach=reach
        )
        for scan in scans
    ]
    z0, y0, x0 = (min(crop.start_zyx[axis] for crop in crops) for axis in range(3))
    z1, y1, x1 = (max(crop.stop_zyx[axis] for crop in crops) for axis in range(3))
    return CropPlan(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def _render(
    scene: Scene, profile: DeviceProfile, begun: Sequence[Begun], opacity_cutoff: float | None
) -> RenderSettings:
    """Return for each level the finest step that any channel needs."""
    step_mm, level_steps = common_steps([channel.steps for channel in begun])
    return RenderSettings(
        step_mm=step_mm,
        level_steps=level_steps,
        opacity_cutoff=opacity_cutoff,
        projection=scene.render.projection,
        tolerance=scene.tolerance,
        hybrid=plan_hybrid(scene, profile),
    )


def _stages(channels: Sequence[ChannelPlan], together: TogetherPlan | None) -> tuple[str, ...]:
    """Return the stages that any channel needs, in order."""
    if channels[0].slices is not None:
        coarser = ("pyramid",) if channels[0].levels[0].index else ()
        return ("import", "quantize", *coarser, "transfer", "slices", "seal")
    sampling = sampling_of(channels[0].volumes[0])
    layout = {"mosaic": "mosaic", "bricks": "bricks"}.get(sampling, "texture")
    tables = any(plan.skip is not None and (plan.skip.tables or plan.skip.ranges) for plan in channels)
    needed = {
        "pyramid": any(level.index for plan in channels for level in plan.levels),
        "normals": any(plan.normals is not None for plan in channels),
        "skip": tables or (together is not None and bool(together.skip_tables)),
        "proxy": any(plan.proxy is not None and plan.proxy.meshes for plan in channels),
        "grid": any(plan.subvolumes is not None for plan in channels),
    }
    order = ("import", "quantize", "pyramid", "transfer", "normals", layout, "skip", "proxy", "grid", "shaders", "seal")
    return tuple(stage for stage in order if needed.get(stage, True))


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


def _left_out(scene: Scene, plan: ChannelPlan) -> list[PlanItem]:
    voxels = sum(math.prod(level.shape_zyx) for level in plan.levels)
    size = voxels * plan.quantize.bits // 8
    reason = "no transfer function is for it"
    return [
        PlanItem(name="channel", channel=name, kept=False, reason=reason, size_bytes=size) for name in left_out(scene)
    ]
