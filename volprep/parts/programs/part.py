"""The part *programs*: the shaders that draw the levels."""

from collections.abc import Iterator
from dataclasses import dataclass

from volprep.parts.ablation import AblationItem, always, by_the_scene, no_change, time_or_wish, where_auto
from volprep.parts.case import Case, Joint
from volprep.parts.part import Part
from volprep.parts.programs.decision import require_light_outside, require_shadows, require_technique, shader_files
from volprep.parts.programs.early_end import AUTO_CUTOFF, EarlyEnd, describe_early_end, early_end_of, most
from volprep.parts.programs.early_end import KIND as EARLY_END
from volprep.parts.programs.source_rays import SourceRays
from volprep.parts.programs.stage import STAGE
from volprep.parts.programs.step import choose_steps, common_steps, describe_steps, layers_of, measures_steps
from volprep.plan.decisions import StepChoice
from volprep.plan.products import OnDemandPlan, SubvolumesPlan
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep.techniques.record import Technique
from volprep_formats.package.manifest import Manifest, PlanItem
from volprep_formats.package.profile import DeviceProfile

_PLAIN = "ray-casting"
_KIND = "shaders"


@dataclass(frozen=True)
class RayChoice:
    """Where the rays of one channel take samples, and where they end."""

    steps: tuple[StepChoice, ...]
    """Distance of the samples that suits each of its levels, finest first."""
    early_end: EarlyEnd
    """Largest opacity of its rays, and the samples behind the cutoff."""


def _require(scene: Scene, profile: DeviceProfile) -> None:
    require_shadows(scene, profile)
    require_technique(scene, profile)


def _plan(case: Case) -> Case:
    require_light_outside(case)
    scene, rays = case.scene, case.part(SourceRays)
    steps = choose_steps(
        scene,
        case.functions,
        case.info,
        case.measured,
        grid=case.grid,
        levels=case.layout.levels,
        in_pieces=_in_pieces(case),
        layers=layers_of(scene.render.technique, case.profile),
        finest=rays.finest if rays else (),
        finer=rays.finer if rays else None,
    )
    return case.plus(RayChoice(steps, early_end_of(case)))


def _in_pieces(case: Case) -> list[LevelPlan]:
    """Return level 0 if the package draws it in pieces or bricks only."""
    layout = case.layout
    beside = [value for value in (case.part(SubvolumesPlan), case.part(OnDemandPlan)) if value is not None]
    finest = layout.candidates[:1] if any(picture.programs for picture in beside) else ()
    return [level for level in finest if level.index < layout.levels[0].index]


def _join(joint: Joint) -> Joint:
    """Give all channels the finest step that one of them needs, and one early end."""
    scene, choices = joint.scene, [case.decided(RayChoice) for case in joint.cases]
    early_end = most([choice.early_end for choice in choices])
    cutoff = early_end.cutoff(scene)
    rays = common_steps([choice.steps for choice in choices]).model_copy(update={"opacity_cutoff": cutoff})
    shared = joint.shared.model_copy(update={"rays": rays, "measure_steps": measures_steps(scene)})
    return joint.plus(items=[describe_early_end(early_end, cutoff, scene)], shared=shared)


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    if plan.programs:
        yield _shaders(plan)
    yield from describe_steps(plan.rays, case.decided(RayChoice).steps)


def _shaders(plan: ChannelPlan) -> PlanItem:
    files = {path for program in plan.programs for path in shader_files(program)}
    finest = plan.volumes[0]
    layout = "3D texture" if finest.sampling == "texture3d" else finest.sampling
    walk = TECHNIQUES[plan.programs[0].technique].text
    return PlanItem(
        name="shaders",
        kind=_KIND,
        kept=True,
        reason=f"{walk} through the {layout}, one program for each transfer function",
        files=tuple(sorted(files)),
    )


def _has_early_end(manifest: Manifest) -> bool | None:
    if all(item.kind != EARLY_END for item in manifest.plan):
        return None
    return manifest.opacity_cutoff is not None


def _has_shadows(manifest: Manifest) -> bool | None:
    return any(program.light is not None and program.light.shadows != "none" for program in manifest.programs) or None


def _finds_the_same(technique: Technique) -> bool:
    """Return whether a technique takes the samples of ray casting, in another order or in several draws."""
    return technique.loops and technique.order is None and technique.name != _PLAIN


def _drawn_by(technique: Technique) -> AblationItem:
    """Return the ablation of a technique in place of ray casting: an app asks for it, to show frames in between."""
    return AblationItem(
        f"technique {technique.name}",
        f"technique-{technique.name}",
        always("wish"),
        without={"render": {"technique": _PLAIN}},
        added=lambda _: {"render": {"technique": technique.name}},
        stated=lambda manifest: any(program.technique == technique.name for program in manifest.programs),
        chosen_by=by_the_scene,
        lossy=True,
    )


PART = Part(
    name="programs",
    require=_require,
    refuse=require_shadows,
    plan=_plan,
    join=_join,
    items=_items,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "early ray termination",
            EARLY_END,
            time_or_wish,
            without={"render": {"opacity_cutoff": 1.0}},
            added=lambda _: {"render": {"opacity_cutoff": AUTO_CUTOFF}},
            stated=_has_early_end,
            chosen_by=where_auto("render.opacity_cutoff"),
            lossy=True,
            with_everything=True,
        ),
        AblationItem(
            "shadows",
            "shadows",
            always("wish"),
            without={"lighting": {"shadows": "none"}},
            # With them it is another picture.
            added=no_change,
            stated=_has_shadows,
            chosen_by=by_the_scene,
        ),
        *(_drawn_by(technique) for technique in TECHNIQUES.values() if _finds_the_same(technique)),
    ),
)
