"""The part *flattened*: one value for the voxels that no picture can show."""

from collections.abc import Iterator
from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.case import Case
from volprep.parts.flattened.decision import KIND, describe_flattened, plan_flattened
from volprep.parts.part import Part
from volprep.plan.products import FlattenedPlan
from volprep.plan.records import ChannelPlan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem


def _plan(case: Case) -> Case:
    return case.plus(plan_flattened(case))


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    return describe_flattened(plan.part(FlattenedPlan), case)


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "plan" if scene.textures.flatten == "auto" else "scene"


PART = Part(
    name="flattened",
    plan=_plan,
    items=_items,
    ablations=(
        AblationItem(
            "flattened voxels",
            KIND,
            always("transport"),
            without={"textures": {"flatten": "none"}},
            added=lambda _: {"textures": {"flatten": "auto"}},
            chosen_by=_chooser,
        ),
    ),
)
