"""The part *classification*: turns values into colours."""

from collections.abc import Iterator
from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.classification.decision import describe_tables, require_classification, require_isovalues
from volprep.parts.classification.stage import STAGE
from volprep.parts.part import Decided, Images, Part
from volprep.plan.functions import describe_functions
from volprep.plan.item_kinds import BEYOND, TABLES
from volprep.plan.records import ChannelPlan, PreintegratedPlan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import Manifest, PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import WITH_TABLES, ProgramDesign

_FLIP, _KEPT_LIGHT = 0.1, 0.7
"""Of preclassified voxels, about: a phantom of shells and soft parts had FLIP 0.08 to 0.09, and kept 0.717."""


def _require(scene: Scene, profile: DeviceProfile) -> None:
    if profile.has_shaders:
        require_classification(scene)


def _items(plan: ChannelPlan, decided: Decided) -> Iterator[PlanItem]:
    yield from describe_functions(decided.case.scene, plan.transfer_functions)
    yield from describe_tables(plan, decided.tables)
    yield from _of_voxels(decided.case.scene)


def _of_voxels(scene: Scene) -> Iterator[PlanItem]:
    allowed = scene.tolerance
    if scene.render.classification != "preclassified" or (allowed.flip >= _FLIP and allowed.kept_light <= _KEPT_LIGHT):
        return
    yield PlanItem(
        name="voxels in colour",
        kind=BEYOND,
        kept=True,
        reason="voxels that are classified before they are interpolated show each edge a voxel wide: at any step "
        f"pictures have a FLIP of up to {_FLIP:g} and keep {_KEPT_LIGHT:g} of the light of thin things, and the "
        f"tolerance is {allowed.flip:g} and {allowed.kept_light:g}; render.classification lookup keeps it, or allow "
        "more in [tolerance]",
    )


def _images(plan: ChannelPlan, transfer: str, _level: int, _program: ProgramDesign | None) -> Images:
    images: Images = {
        each.file: (each.format, (1, 1, each.entries)) for each in plan.lookups if each.transfer == transfer
    }
    tables = (each for each in plan.preintegrated if each.transfer == transfer)
    return images | {each.file: (each.format, each.shape_zyx) for each in tables}


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "plan" if scene.render.classification == "auto" else "scene"


def _has_preintegrated(manifest: Manifest, _transfer: str) -> bool | None:
    names = {program.classification for program in manifest.programs}
    return "preintegrated" in names if names <= WITH_TABLES else None


PART = Part(
    name="classification",
    require=_require,
    require_scan=require_isovalues,
    items=_items,
    images=_images,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "pre-integrated table",
            TABLES[PreintegratedPlan],
            always("truth"),
            _has_preintegrated,
            without={"render": {"classification": "lookup"}},
            added=lambda scene: None if scene.editable else {"render": {"classification": "preintegrated"}},
            chosen_by=_chooser,
            lossy=True,
        ),
    ),
)
