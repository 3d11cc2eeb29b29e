"""The part *compression*: textures of levels in compressed blocks."""

from collections.abc import Iterator
from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.case import Case
from volprep.parts.compression.colour import with_blocks
from volprep.parts.compression.decision import KIND, choose_form
from volprep.parts.part import Part
from volprep.plan.decisions import CompressionChoice
from volprep.plan.records import ChannelPlan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem


def _plan(case: Case) -> Case:
    return case if case.part(CompressionChoice) else case.plus(choose_form(case))


def _items(_plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    yield from case.decided(CompressionChoice).items


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "plan" if scene.textures.compression == "auto" else "scene"


PART = Part(
    name="compression",
    measure=with_blocks,
    plan=_plan,
    items=_items,
    ablations=(
        AblationItem(
            "compressed texels",
            KIND,
            always("memory"),
            without={"textures": {"compression": "none"}},
            added=lambda _: {"textures": {"compression": "auto"}},
            chosen_by=_chooser,
            lossy=True,
        ),
    ),
)
