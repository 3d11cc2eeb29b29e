"""The part *light*: light that is computed once and multiplies the colours of samples."""

from collections.abc import Iterator

from volprep.parts.ablation import AblationItem, always, by_the_scene, no_change
from volprep.parts.light.decision import KIND, beside_level, light_items, plan_light, require_light
from volprep.parts.light.stage import STAGE
from volprep.parts.part import Decided, Images, LaidOut, Part
from volprep.plan.products import LightPlan
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import Manifest, PlanItem
from volprep_formats.package.program import ProgramDesign


def _plan(channel: LaidOut) -> LightPlan | None:
    case = channel.case
    labels = case.values.quantize.labels
    return plan_light(case.scene, channel.layout.profile, case.grid, case.functions, case.light, labels=labels)


def _items(plan: ChannelPlan, decided: Decided) -> Iterator[PlanItem]:
    case = decided.case
    return light_items(plan.part(LightPlan), case.scene, plan.grid, case.light)


def _images(plan: ChannelPlan, transfer: str, _level: int, program: ProgramDesign | None) -> Images:
    light = plan.part(LightPlan)
    if light is None or program is None or not program.baked:
        return {}
    return {
        each.file: (light.format, light.texels_zyx)
        for each in light.textures
        if each.transfer == transfer and not each.is_of_a_cut
    }


def _has(manifest: Manifest, _transfer: str) -> bool | None:
    return any(program.baked for program in manifest.programs) or None


PART = Part(
    name="light",
    require=require_light,
    beside=beside_level,
    plan=_plan,
    items=_items,
    images=_images,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "baked light",
            KIND,
            always("wish"),
            _has,
            without={"lighting": {"baked": "none"}},
            # With it, it is another picture.
            added=no_change,
            chosen_by=by_the_scene,
        ),
    ),
)
