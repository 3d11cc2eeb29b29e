"""The part *compression*: textures of levels in compressed blocks."""

from collections.abc import Iterator
from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.compression.decision import KIND
from volprep.parts.part import Decided, Part
from volprep.plan.records import ChannelPlan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import Manifest, PlanItem


def _items(_plan: ChannelPlan, decided: Decided) -> Iterator[PlanItem]:
    yield from decided.compression.items


def _has(manifest: Manifest, _transfer: str) -> bool:
    return any(form.kept for form in manifest.compression)


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "plan" if scene.textures.compression == "auto" else "scene"


PART = Part(
    name="compression",
    items=_items,
    ablations=(
        AblationItem(
            "compressed texels",
            KIND,
            always("memory"),
            _has,
            without={"textures": {"compression": "none"}},
            added=lambda _: {"textures": {"compression": "auto"}},
            chosen_by=_chooser,
            lossy=True,
        ),
    ),
)
