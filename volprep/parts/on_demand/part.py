"""The part *on demand*: all levels in bricks. A device fetches and holds the bricks that its view needs."""

from collections.abc import Iterator

from volprep.parts.ablation import AblationItem, always, by_the_scene
from volprep.parts.case import Case
from volprep.parts.on_demand.decision import (
    KIND,
    describe_on_demand,
    levels_on_demand,
    one_volume,
    plan_on_demand,
    require_on_demand,
)
from volprep.parts.on_demand.stage import STAGE
from volprep.parts.part import Part
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import PlanItem


def _plan(case: Case) -> Case:
    bits, pictures = case.values.quantize.bits, tuple(each.name for each in case.functions)
    return case.plus(plan_on_demand(case.scene, case.profile, levels_on_demand(case), bits, pictures))


def _items(plan: ChannelPlan, _case: Case) -> Iterator[PlanItem]:
    return describe_on_demand(plan)


PART = Part(
    name="on_demand",
    prepare=one_volume,
    require=require_on_demand,
    refuse=require_on_demand,
    plan=_plan,
    items=_items,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "bricks on demand",
            KIND,
            always("wish"),
            without={"on_demand": None},
            added=lambda _: {"on_demand": {"size": 32}},
            chosen_by=by_the_scene,
        ),
    ),
)
