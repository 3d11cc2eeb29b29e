"""The part *on demand*: all levels in bricks. A device fetches and holds the bricks that its view needs."""

from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.case import Case
from volprep.parts.on_demand.decision import (
    KIND,
    describe_on_demand,
    one_volume,
    plan_on_demand,
    require_on_demand,
    settings_of,
)
from volprep.parts.on_demand.stage import STAGE
from volprep.parts.part import Part
from volprep.plan.room import Misfit
from volprep.scene.scene import Scene


def _plan(case: Case) -> Case:
    found = plan_on_demand(case, case.layout.levels[0].index)
    return case if isinstance(found, Misfit) else case.plus(found)


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "plan" if settings_of(scene).use == "auto" else "scene"


PART = Part(
    name="on_demand",
    prepare=one_volume,
    require=require_on_demand,
    refuse=require_on_demand,
    plan=_plan,
    items=describe_on_demand,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "bricks on demand",
            KIND,
            always("wish"),
            without={"on_demand": {"use": "never"}},
            added=lambda _: {"on_demand": {"size": 32}},
            chosen_by=_chooser,
        ),
    ),
)
