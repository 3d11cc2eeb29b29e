"""The part *frames*: a time series, whose frames are made by one plan."""

from volprep.parts.case import Case
from volprep.parts.frames.decision import KIND, describe_frames, plan_frames, require_possible, with_fixed_filter
from volprep.parts.part import Part
from volprep.plan.products import FramesPlan
from volprep.plan.records import Plan
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.storage.draft import Draft


def _plan(case: Case) -> Case:
    return case.plus(plan_frames(case))


def _settle(items: tuple[PlanItem, ...], draft: Draft, _plan: Plan) -> tuple[PlanItem, ...]:
    """Complete the item with its files, and with the share of later frames that is held once."""
    made = next((stage for stage in draft.manifest.stages if stage.name == FramesPlan.STAGE), None)
    if made is None:
        return items
    sizes = {record.path: record.size_bytes for record in draft.manifest.files_of("texture")}
    files = tuple(path for path in made.files if path in sizes)
    of_texture = {texture.name: sizes[texture.file] for texture in draft.manifest.textures}
    shown = {(drawing.frame or 0, name) for _, drawing in draft.manifest.drawings for name in drawing.textures}
    all_bytes = sum(of_texture[name] for frame, name in shown if frame)
    new_bytes = sum(sizes[path] for path in files)
    share = 1 - new_bytes / all_bytes if all_bytes else 1.0
    told = f"; {share:.1%} of the bytes of later frames are held once"
    return tuple(
        item.model_copy(update={"files": files, "reason": item.reason + told}) if item.kind == KIND else item
        for item in items
    )


PART = Part(
    name="frames",
    prepare=with_fixed_filter,
    require=require_possible,
    refuse=require_possible,
    devices="any",
    plan=_plan,
    items=describe_frames,
    settle=_settle,
)
