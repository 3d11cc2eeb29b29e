"""The part *bricks*: levels as bricks with ghost voxels in one 3D texture."""

from collections.abc import Iterator

from volprep.parts.ablation import AblationItem, always, by_the_scene
from volprep.parts.bricks.decision import KIND, describe_bricks, require_bricks
from volprep.parts.bricks.stage import STAGE
from volprep.parts.case import Case
from volprep.parts.part import Part
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import PlanItem


def _items(plan: ChannelPlan, _case: Case) -> Iterator[PlanItem]:
    return describe_bricks(plan.volumes)


PART = Part(
    name="bricks",
    require=require_bricks,
    items=_items,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "bricks",
            KIND,
            always("memory"),
            without={"bricks": None},
            added=lambda _: {"bricks": {}},
            chosen_by=by_the_scene,
        ),
    ),
)
