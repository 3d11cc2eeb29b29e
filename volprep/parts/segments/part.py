"""The part *segments*: labels of the voxels, and what each of them looks like."""

from collections.abc import Iterator

from volprep.parts.case import Case
from volprep.parts.part import Part, PlannedImage
from volprep.parts.segments.decision import (
    label_sets,
    plan_segments,
    require_possible,
    segment_items,
    skip_tables,
    with_segments,
    within_styles,
)
from volprep.parts.segments.label_texture import beside_segments
from volprep.parts.segments.level_light import settle
from volprep.parts.segments.look_format import look_format
from volprep.parts.segments.stage import STAGE
from volprep.parts.skip.part import found_of
from volprep.plan.item_kinds import BEYOND
from volprep.plan.products import SegmentsPlan
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.segments.record import table_shape


def _plan(case: Case) -> Case:
    return case.plus(plan_segments(case, found_of(case)))


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    segments = plan.part(SegmentsPlan)
    if segments is not None and case.segments is not None:
        yield from segment_items(segments, case.segments, case.scene)
        tables, item = skip_tables(case, segments, found_of(case))
        yield item
        yield label_sets(tables, case.layout.levels, case.profile)[1]
        held = look_format(segments, case)
        if held.is_beyond:
            yield PlanItem(
                name="opacities of segments",
                kind=BEYOND,
                kept=True,
                reason=f"profile {case.profile.name} holds opacities of segments as bytes, and pixels may be off by "
                f"{held.off:.2g}: validate may find pictures beyond the tolerance. Choose larger opacities, or a "
                "profile with rgba16float",
            )


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    segments = plan.part(SegmentsPlan)
    if segments is None:
        return
    yield PlannedImage(segments.looks, segments.look_format, (1, *table_shape(len(segments.labels))))
    for texture in segments.textures:
        for file in texture.files:
            yield PlannedImage(file, segments.format, texture.shape_zyx, level=texture.level)


PART = Part(
    name="segments",
    prepare=with_segments,
    require=require_possible,
    refuse=require_possible,
    begin=within_styles,
    beside=beside_segments,
    plan=_plan,
    items=_items,
    images=_images,
    stages=(STAGE,),
    settle=settle,
)
