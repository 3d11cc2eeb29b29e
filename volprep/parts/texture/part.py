"""The part *texture*: levels as 3D textures, each in a file of its own or all as the mipmaps of one."""

from collections.abc import Iterator

from volprep.parts.ablation import AblationItem, always, by_the_scene
from volprep.parts.case import Case
from volprep.parts.part import Part
from volprep.parts.texture.mipmaps import KIND, describe_mipmaps
from volprep.parts.texture.stage import STAGE
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import PlanItem


def _items(plan: ChannelPlan, _case: Case) -> Iterator[PlanItem]:
    return describe_mipmaps(plan.levels, plan.volumes)


PART = Part(
    name="texture",
    items=_items,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "mipmaps",
            KIND,
            always("wish"),
            without={"textures": {"mipmaps": False}},
            added=lambda _: {"textures": {"mipmaps": True}},
            chosen_by=by_the_scene,
        ),
    ),
)
