"""The part *skip*: tables that let rays jump over empty space."""

from collections.abc import Iterator

from volprep.compositing import COMPOSITINGS
from volprep.parts.ablation import AblationItem, always, by_the_scene, time_or_wish, where_auto
from volprep.parts.case import Case
from volprep.parts.part import Part, PlannedImage
from volprep.parts.skip.decision import KIND, RANGES_KIND, SkipInputs, describe_skip, plan_skip
from volprep.parts.skip.stage import STAGE
from volprep.parts.stage import required
from volprep.plan.products import NormalsPlan, SkipPlan
from volprep.plan.records import ChannelPlan
from volprep.techniques import TECHNIQUES
from volprep_formats.package.manifest import PlanItem


def found_of(case: Case) -> SkipInputs:
    """Return the inputs of decisions about empty space."""
    layout = case.layout
    return SkipInputs(
        profile=layout.profile,
        crop=case.crop,
        grid=case.grid,
        quantize=case.values.quantize,
        entries=case.values.entries,
        levels=layout.levels,
        volumes=layout.volumes,
        measured=case.measured,
        normals=case.part(NormalsPlan),
        compositing=COMPOSITINGS[case.scene.render.compositing],
        editable=case.scene.editable,
        loops=TECHNIQUES[case.scene.render.technique].loops,
    )


def _plan(case: Case) -> Case:
    return case.plus(plan_skip(case.scene.skip, case.shown_alone, found_of(case)))


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    return describe_skip(required(plan.part(SkipPlan)), case.shown_alone, case.scene.skip, found_of(case))


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    skip = plan.part(SkipPlan)
    for table in skip.tables if skip else ():
        yield PlannedImage(table.file, table.format, table.shape_zyx, table.transfer, table.level)


PART = Part(
    name="skip",
    plan=_plan,
    items=_items,
    images=_images,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "skip table",
            KIND,
            time_or_wish,
            without={"skip": {"kind": "none"}},
            added=lambda _: {"skip": {"kind": "distance"}},
            chosen_by=where_auto("skip.kind"),
            for_each_transfer=True,
            with_everything=True,
        ),
        AblationItem(
            "ranges of blocks",
            RANGES_KIND,
            always("wish"),
            without={"skip": {"ranges": False}, "editable": False},
            added=lambda scene: None if scene.editable else {"skip": {"ranges": True}},
            chosen_by=by_the_scene,
            with_everything=True,
        ),
    ),
)
