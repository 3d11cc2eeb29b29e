"""The part *layout*: which levels a package holds, and the textures that hold them."""

from collections.abc import Iterator

from volprep.parts.bricks.flat import index_zyx
from volprep.parts.case import Case
from volprep.parts.layout.decision import lay_out
from volprep.parts.layout.items import describe_layout, describe_levels
from volprep.parts.part import Part, PlannedImage
from volprep.plan.decisions import CompressionChoice
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import PlanItem


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
