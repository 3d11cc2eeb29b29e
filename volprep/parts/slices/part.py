"""The part *slices*: stacks of slices, for devices without shaders."""

from collections.abc import Iterator

from volprep.parts.case import Case, Joint
from volprep.parts.part import Part, PlannedImage
from volprep.parts.programs.step import common_steps
from volprep.parts.slices.decision import SlicesChoice, describe_slices, plan_of_slices, refuse_slices, with_slices
from volprep.parts.slices.error import settle
from volprep.parts.slices.stage import STAGE
from volprep.plan.decisions import Layout, StepChoice
from volprep.plan.products import SlicesPlan
from volprep.plan.records import ChannelPlan
from volprep.plan.room import Beside
from volprep_formats.package.manifest import PlanItem


def _plan(case: Case) -> Case:
    choice = plan_of_slices(case.channel, case.scene, case.profile, case.grid, case.functions)
    layout = Layout(case.profile, Beside(units=0, bytes=0), [], [], (choice.level,), ())
    return case.plus(choice, choice.slices, layout)


def _join(joint: Joint) -> Joint:
    """Let rays have the distance of the slices."""
    choices = [case.decided(SlicesChoice) for case in joint.cases]
    steps = [StepChoice(choice.level.index, choice.distance_mm, "the distance of voxels") for choice in choices]
    return joint.plus(shared=joint.shared.model_copy(update={"rays": common_steps([steps])}))


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    return describe_slices(plan, case.decided(SlicesChoice))


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    slices = plan.part(SlicesPlan)
    if slices is None:
        return
    for stack in slices.stacks:
        for texture in stack.textures:
            yield PlannedImage(texture.file, slices.format, (1, *texture.shape_yx), stack.transfer, slices.level)


PART = Part(
    name="slices",
    prepare=with_slices,
    devices="without shaders",
    refuse=refuse_slices,
    plan=_plan,
    join=_join,
    items=_items,
    images=_images,
    stages=(STAGE,),
    settle=settle,
)
