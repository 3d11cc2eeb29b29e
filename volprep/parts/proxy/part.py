"""The part *proxy*: meshes around visible voxels; rays begin and end on them."""

from collections.abc import Iterator
from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.case import Case
from volprep.parts.part import Part
from volprep.parts.programs.decision import shader_files
from volprep.parts.proxy.decision import KIND, describe_proxy, plan_proxy
from volprep.parts.proxy.files import DRACO_RULE
from volprep.parts.proxy.stage import STAGE
from volprep.parts.skip.part import found_of
from volprep.plan.products import ProxyPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.storage.draft import Draft


def _plan(case: Case) -> Case:
    wanted = case.scene.proxy
    return case.plus(plan_proxy(wanted, case.functions, case.layout.programs, found_of(case))) if wanted else case


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    wanted = case.scene.proxy
    if wanted is not None:
        proxy = plan.part(ProxyPlan)
        listed = {path for program in plan.programs for path in shader_files(program)}
        yield from describe_proxy(proxy, plan.transfer_functions, wanted, found_of(case), listed)


def _settle(items: tuple[PlanItem, ...], draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Add the meshes: the stage knows which are empty, and which are compressed."""
    wishes = {proxy.draco for channel in plan.channels if (proxy := channel.part(ProxyPlan)) is not None}
    why = DRACO_RULE if wishes == {"auto"} else "as the scene asks"
    meshes = draft.manifest.proxy.meshes if draft.manifest.proxy else ()
    settled = []
    for item in items:
        own = {mesh.file: mesh.draco for mesh in meshes if mesh.file and mesh.transfer == item.transfer}
        if item.kind != KIND or not own:
            settled.append(item)
            continue
        reason = f"{item.reason}; {sum(own.values())} of {len(own)} files compressed with Draco, {why}"
        settled.append(item.model_copy(update={"files": (*item.files, *own), "reason": reason}))
    return tuple(settled)


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "scene" if scene.proxy is None else "plan"


PART = Part(
    name="proxy",
    plan=_plan,
    items=_items,
    stages=(STAGE,),
    settle=_settle,
    ablations=(
        AblationItem(
            "proxy mesh",
            KIND,
            always("time"),
            without={"proxy": None},
            added=lambda scene: None if scene.editable else {"proxy": {"form": "merged"}},
            chosen_by=_chooser,
            for_each_transfer=True,
            with_everything=True,
        ),
    ),
)
