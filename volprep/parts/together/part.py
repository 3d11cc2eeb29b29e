"""The part *together*: several channels in one picture, and in common texels."""

from dataclasses import replace

from volprep.parts.case import Case, Joint
from volprep.parts.part import Part
from volprep.parts.together.decision import choose_together, plan_together
from volprep.parts.together.grids import grids_of
from volprep.parts.together.packing import pack_channels


def _begin(case: Case) -> Case:
    """Let the channels of a volume in colour have no pictures of their own."""
    return replace(case, drawn_alone=case.scene.render.classification != "colour")


def _join(joint: Joint) -> Joint:
    """Decide which channels are drawn into one picture, and which share texels. Raises VP1245 as these do."""
    scene, measured = joint.scene, [case.measured for case in joint.cases]
    drawn = choose_together(joint.channels, measured, scene)
    packed = pack_channels(joint.channels, scene, [*drawn.transfers])
    joint = joint.plus(items=packed.items, of_cases=packed)
    grids = grids_of(joint.cases, drawn.transfers, scene)
    together, items = plan_together(joint.channels, measured, drawn, packed, scene, grids=grids)
    return joint.plus(together, items=items)


PART = Part(name="together", begin=_begin, join=_join)
