"""The part *layout*: which levels a package holds, and the textures that hold them."""

from collections.abc import Iterator

from volprep.parts.bricks.flat import index_zyx
from volprep.parts.case import Case
from volprep.parts.layout.decision import lay_out
from volprep.parts.layout.items import describe_layout, describe_levels
from volprep.parts.part import Images, Part
from volprep.plan.decisions import CompressionChoice
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.program import ProgramDesign


def _plan(case: Case) -> Case:
    return case.plus(lay_out(case, case.decided(CompressionChoice).form))


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    yield from describe_levels(plan, case, case.layout)
    yield from describe_layout(plan, case.scene)


def _images(plan: ChannelPlan, transfer: str, level: int, _program: ProgramDesign | None) -> Images:
    own = [each for each in plan.volumes if each.level == level and each.transfer in {None, transfer}]
    files = {file for each in own for file in each.files}
    # All mipmaps of a texture are uploaded with it.
    held = [each for each in plan.volumes if not files.isdisjoint(each.files)]
    images: Images = {
        f"{file} {each.mipmap or 0}": (each.format, each.shape_zyx) for each in held for file in each.files
    }
    for each in held:
        images |= _places(plan, each)
    return images


def _places(plan: ChannelPlan, volume: VolumePlan) -> Images:
    """Return the texture of the places of bricks, as large as it is if no brick is empty."""
    bricks = volume.bricks
    if bricks is None:
        return {}
    shape_zyx = plan.level(volume.level).shape_zyx
    return {bricks.file: ("rgba8unorm", index_zyx(shape_zyx, bricks.size, plan.profile))}


PART = Part(name="layout", plan=_plan, items=_items, images=_images)
