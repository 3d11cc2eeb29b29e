"""The part *subvolumes*: level 0 in pieces, for devices that cannot hold it whole."""

from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.case import Case
from volprep.parts.part import Part
from volprep.parts.subvolumes.decision import KIND, describe_subvolumes, plan_subvolumes, voxels_of
from volprep.parts.subvolumes.stage import STAGE
from volprep.plan.products import SegmentsPlan
from volprep.plan.records import Plan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.storage.draft import Draft


def _plan(case: Case) -> Case:
    stored, segments = case.values.quantize, case.part(SegmentsPlan)
    voxels = voxels_of(case.scene, stored.bits, stored.filter, segments)
    pictures = (segments.name,) if segments else tuple(function.name for function in case.functions)
    return case.plus(plan_subvolumes(case.scene, case.profile, case.grid, voxels, case.layout.volumes, pictures))


def _settle(items: tuple[PlanItem, ...], draft: Draft, _plan: Plan) -> tuple[PlanItem, ...]:
    """Add the files of the pieces: the stage knows which are empty."""
    found = draft.manifest.subvolumes
    if found is None:
        return items
    return tuple(
        item.model_copy(update={"files": (*item.files, *found.pieces)}) if item.kind == KIND else item for item in items
    )


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "plan" if scene.grid is not None and scene.grid.size == "auto" else "scene"


PART = Part(
    name="subvolumes",
    plan=_plan,
    items=lambda plan, case: describe_subvolumes(plan, case.scene),
    stages=(STAGE,),
    settle=_settle,
    ablations=(
        AblationItem(
            "sub-volumes",
            KIND,
            always("wish"),
            without={"grid": None},
            added=lambda _: {"grid": {"size": 64}},
            chosen_by=_chooser,
            with_everything=True,
        ),
    ),
)
