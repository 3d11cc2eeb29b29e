"""Make the plan of a package: what its channels have in common is decided once, the rest for each.

All channels have one step and one early end of rays; those on the grid of the first one also have one crop, because
they have one box.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case, Joint
from volprep.parts.channel_rays import with_rays
from volprep.parts.registry import PARTS, parts_of
from volprep.pipeline.costs import planned_costs
from volprep.pipeline.stage_graph import planned_stages
from volprep.plan.classifications import possible_classifications
from volprep.plan.crop import choose_crop
from volprep.plan.functions import resolved_functions
from volprep.plan.item_kinds import FIRST_LOOK
from volprep.plan.item_kinds import PREVIEW as PREVIEW_KIND
from volprep.plan.products import TogetherPlan
from volprep.plan.records import PREVIEW, ChannelPlan, CropPlan, Plan, Shared
from volprep.plan.whole_source import WholeSource
from volprep.scan.segments.record import FoundSegments
from volprep.scan.slabs import RawVolume
from volprep.scan.statistics import Measured
from volprep.scene.channels import drawn_channels, left_out
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem, RenderSettings
from volprep_formats.package.picture import SeriesFrame
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import RaySampling
from volprep_formats.source import ChannelSpec, SourceInfo

_PREVIEW = PlanItem(
    name="preview", kind=PREVIEW_KIND, kept=True, reason="a thumbnail for people who browse packages", files=(PREVIEW,)
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
    frames: tuple[SeriesFrame, ...] = ()
    """Frames of a time series; `voxels` and `whole` belong to one of them."""


def make_plan(
    scene: Scene,
    profile: DeviceProfile,
    scanned: Sequence[Scanned],
    segments: FoundSegments | None = None,
    labels: RawVolume | None = None,
) -> Plan:
    """Decide everything for the channels that are drawn, in the order of `drawn_channels`.

    `labels` are the labels of `segments` on the grid of the source, if known: steps are measured with them.

    Raises the errors of parts, and VP1244 for parts that do not support several channels.
    """
    wanted = scene.render.classification
    kinds = possible_classifications(scene, lambda scene_of_kind: _prepared(scene_of_kind, profile, len(scanned)))
    scene = _prepared(scene.with_classification(kinds[0]), profile, len(scanned))
    cases = _cases(scene, profile, scanned, segments, labels)
    cases = [replace(case, classifications=kinds if wanted == "auto" else ()) for case in cases]
    cases = [with_rays(case) for case in _cropped(scene, cases)]
    for part in parts_of(profile):
        cases = [*part.measure(cases, lambda tried: _joined(scene, tried))]
    joint = _joined(scene.with_classification(cases[0].scene.render.decided_classification), cases)
    channels = joint.channels
    items = [
        *_describe_look(scene),
        *_of_channels(channels, [_items(case, plan) for case, plan in zip(joint.cases, channels, strict=True)]),
        *joint.items,
        _PREVIEW,
        *_left_out(scene, channels[0]),
    ]
    plan = Plan(
        shared=joint.shared,
        channels=channels,
        together=joint.part(TogetherPlan),
        fidelity=scene.fidelity,
        stages=(),
        items=tuple(items),
    )
    return plan.model_copy(update={"stages": planned_stages(plan), "costs": planned_costs(plan)})


def _prepared(scene: Scene, profile: DeviceProfile, channels: int) -> Scene:
    """Return the scene with the settings that parts need. Raises the errors of parts."""
    possible = parts_of(profile)
    for part in possible:
        scene = part.prepare(scene, profile, channels)
    for part in PARTS:
        (part.require if part in possible else part.refuse)(scene, profile)
    return scene


def _cases(
    scene: Scene,
    profile: DeviceProfile,
    scanned: Sequence[Scanned],
    segments: FoundSegments | None,
    labels: RawVolume | None,
) -> list[Case]:
    """Return the channels with all of their voxels, as parts begin with them. Raises the errors of parts."""
    parts, cases = parts_of(profile), []
    for channel, found in zip(drawn_channels(scene), scanned, strict=True):
        own = scene.with_source(channel.spec).with_transfer(channel.transfer)
        case = Case(
            channel=channel.name,
            scene=own,
            profile=profile,
            info=found.info,
            measured=found.measured,
            functions=resolved_functions(own, found.info, found.measured),
            crop=CropPlan(start_zyx=(0, 0, 0), stop_zyx=found.info.grid.shape_zyx),
            grid=found.info.grid,
            placed=channel.spec.affine if isinstance(channel.spec, ChannelSpec) else None,
            neighbours=tuple(part.beside for part in parts if part.beside is not None),
            whole=found.whole,
            voxels=found.voxels,
            frames=found.frames,
            segments=segments,
            labels=labels,
        )
        for part in PARTS:
            case = part.begin(case)
        cases.append(case)
    return cases


def _joined(scene: Scene, cases: Sequence[Case]) -> Joint:
    """Plan each channel, and then what they share. Raises the errors of parts."""
    first, parts, planned = cases[0], parts_of(cases[0].profile), []
    for case in cases:
        for part in parts:
            case = part.plan(case)  # noqa: PLW2901 - each part adds its decision
        planned.append(case)
    shared = Shared(
        profile=first.profile,
        crop=first.crop,
        grid=first.grid,
        render=RenderSettings(projection=scene.render.projection, tolerance=scene.tolerance),
        rays=RaySampling(step_mm=min(first.grid.spacing_mm_zyx)),
        compositing=scene.render.compositing,
    )
    joint = Joint(scene, tuple(planned), shared)
    for part in reversed(parts):
        joint = part.join(joint)
    return joint


def _items(case: Case, plan: ChannelPlan) -> list[PlanItem]:
    return [item for part in parts_of(case.profile) for item in part.items(plan, case)]


def _cropped(scene: Scene, cases: Sequence[Case]) -> list[Case]:
    """Return the channels without the border that none of those on the same grid shows."""
    of_grid = {case.info.grid: [other for other in cases if other.info.grid == case.info.grid] for case in cases}
    crops = {grid: _common_crop(scene, value) for grid, value in of_grid.items()}
    found = []
    for case in cases:
        crop = crops[case.info.grid]
        found.append(replace(case, crop=crop, grid=case.info.grid.part(crop.start_zyx, crop.stop_zyx)))
    return found


def _common_crop(scene: Scene, cases: Sequence[Case]) -> CropPlan:
    """Return the smallest box that holds what each channel shows."""
    shown = COMPOSITINGS[scene.render.compositing].visible_table
    # Not for normals that nothing lights by: the verb that adds them to a draft would have to begin again.
    reach = 0 if scene.render.lighting == "none" else 1
    crops = [
        choose_crop(
            scene.crop,
            [shown(Table.exact(function)) for function in case.functions],
            case.measured.ranges_zyx,
            reach=reach,
            boxes=[case.boxes.get(function.name) for function in case.functions],
        )
        for case in cases
    ]
    z0, y0, x0 = (min(crop.start_zyx[axis] for crop in crops) for axis in range(3))
    z1, y1, x1 = (max(crop.stop_zyx[axis] for crop in crops) for axis in range(3))
    return CropPlan(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def _of_channels(plans: Sequence[ChannelPlan], items: Sequence[Sequence[PlanItem]]) -> list[PlanItem]:
    """List the decisions about each channel, with its name.

    Raises VP1244 for an item of two channels that would be the same file; only shaders may be.
    """
    listed: list[PlanItem] = []
    claimed: set[str] = set()
    for plan, plan_item in zip(plans, items, strict=True):
        for item in plan_item:
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
