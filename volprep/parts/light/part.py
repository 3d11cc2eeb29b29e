"""The part *light*: light that is computed once and multiplies the colours of samples."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from volprep.parts.ablation import AblationItem, always, by_the_scene, no_change
from volprep.parts.case import Case, Trial
from volprep.parts.light.decision import KIND, beside_level, light_items, plan_light, require_light
from volprep.parts.light.stage import STAGE
from volprep.parts.light.trial import try_light
from volprep.parts.part import Part, PlannedImage
from volprep.plan.decisions import LightChoice
from volprep.plan.products import LightPlan
from volprep.plan.records import ChannelPlan
from volprep_formats.package.program import ProgramDesign


def _measure(cases: Sequence[Case], _trial: Trial) -> list[Case]:
    return [_tried(case) for case in cases]


def _tried(case: Case) -> Case:
    """Measure light that the scene wants, if the whole source is known; leave it out if it is not worth its texture."""
    whole, scene = case.whole, case.scene
    if whole is None or scene.source.labels:
        return case
    choice = try_light(scene, whole.volume, whole.info, case.crop, case.grid, case.functions, whole.progress)
    if choice is not None and choice.factor is None:
        lighting = scene.lighting.model_copy(update={"baked": "none"})
        case = replace(case, scene=scene.model_copy(update={"lighting": lighting}))
    return case.plus(choice)


def _plan(case: Case) -> Case:
    labels, choice = case.values.quantize.labels, case.part(LightChoice)
    return case.plus(plan_light(case.scene, case.layout.profile, case.grid, case.functions, choice, labels=labels))


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    light = plan.part(LightPlan)
    if light is None:
        return
    for texture in light.textures:
        if not texture.is_of_a_cut:
            yield PlannedImage(texture.file, light.format, light.texels_zyx, texture.transfer, is_read_by=_reads)


def _reads(program: ProgramDesign) -> bool:
    return program.baked


PART = Part(
    name="light",
    require=require_light,
    refuse=require_light,
    beside=beside_level,
    measure=_measure,
    plan=_plan,
    items=lambda plan, case: light_items(plan.part(LightPlan), case.scene, plan.grid, case.part(LightChoice)),
    images=_images,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "baked light",
            KIND,
            always("wish"),
            without={"lighting": {"baked": "none"}},
            # With it, it is another picture.
            added=no_change,
            stated=lambda manifest: any(program.baked for program in manifest.programs) or None,
            chosen_by=by_the_scene,
        ),
    ),
)
