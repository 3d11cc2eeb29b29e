"""The part *segments*: labels of the voxels, and what each of them looks like."""

from collections.abc import Iterator

from volprep.parts.part import Decided, Images, LaidOut, Part
from volprep.parts.segments.beside import beside_segments
from volprep.parts.segments.decision import (
    label_sets,
    plan_segments,
    require_possible,
    segment_items,
    skip_tables,
    with_segments,
)
from volprep.parts.segments.level_light import settle
from volprep.parts.segments.stage import STAGE
from volprep.parts.skip.part import found_of
from volprep.plan.products import SegmentsPlan
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.segments.record import table_shape
from volprep_formats.package.program import ProgramDesign


def _plan(channel: LaidOut) -> SegmentsPlan | None:
    return plan_segments(channel, found_of(channel))


def _items(plan: ChannelPlan, decided: Decided) -> Iterator[PlanItem]:
    segments, case = plan.part(SegmentsPlan), decided.case
    if segments is not None and case.segments is not None:
        yield from segment_items(segments, case.segments, case.scene)
        tables, item = skip_tables(case, segments, found_of(decided.laid_out))
        yield item
        yield label_sets(tables, decided.laid_out.layout.levels, case.profile)[1]


def _images(plan: ChannelPlan, _transfer: str, level: int, _program: ProgramDesign | None) -> Images:
    segments = plan.part(SegmentsPlan)
    if segments is None:
        return {}
    own = [each for each in segments.textures if each.level == level]
    images: Images = {file: (segments.format, each.shape_zyx) for each in own for file in each.files}
    return images | {segments.looks: ("rgba8unorm", (1, *table_shape(len(segments.labels))))}


PART = Part(
    name="segments",
    prepare=with_segments,
    require=require_possible,
    beside=beside_segments,
    plan=_plan,
    items=_items,
    images=_images,
    stages=(STAGE,),
    settle=settle,
)
