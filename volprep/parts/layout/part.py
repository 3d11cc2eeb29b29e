"""The part *layout*: which levels a package holds, and the textures that hold them."""

from collections.abc import Iterator

from volprep.parts.bricks.flat import index_zyx
from volprep.parts.layout.items import describe_layout, describe_levels
from volprep.parts.part import Decided, Images, Part
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.program import ProgramDesign


def _items(plan: ChannelPlan, decided: Decided) -> Iterator[PlanItem]:
    yield from describe_levels(plan, decided.case, decided.laid_out.layout)
    yield from describe_layout(plan, decided.case.scene)


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


PART = Part(name="layout", items=_items, images=_images)
