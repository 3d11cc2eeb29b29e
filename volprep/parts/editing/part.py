"""The part *editing*: data for apps whose users edit transfer functions."""

from collections.abc import Iterator

from volprep.parts.ablation import AblationItem, always, by_the_scene
from volprep.parts.case import Case
from volprep.parts.editing.decision import KIND, describe_editing, for_edits, plan_editing
from volprep.parts.part import Part
from volprep.plan.products import EditingPlan
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import Manifest, PlanItem


def _plan(case: Case) -> Case:
    return case.plus(plan_editing(case.scene, case.grid, case.layout.levels))


def _items(plan: ChannelPlan, _case: Case) -> Iterator[PlanItem]:
    return describe_editing(plan.part(EditingPlan))


def _has(manifest: Manifest) -> bool:
    return manifest.editing is not None


PART = Part(
    name="editing",
    prepare=for_edits,
    plan=_plan,
    items=_items,
    ablations=(
        AblationItem(
            "what edits need",
            KIND,
            always("wish"),
            without={"editable": False},
            # No filter may rest on a transfer function.
            added=lambda _: {"editable": True, "pyramid": {"filter": "box"}},
            stated=_has,
            chosen_by=by_the_scene,
            lossy=True,
        ),
    ),
)
