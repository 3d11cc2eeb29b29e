"""The part *compression*: textures of levels in compressed blocks.

In a volume in colour light and extinction share texels, so that one form is tried for all channels, on their common
layout, and its pictures are measured: blocks mix the colours of neighbours, and rays through a few patches miss where
that is worst.
"""

from collections.abc import Iterator, Sequence

from volprep.parts.ablation import AblationItem, always, where_auto
from volprep.parts.case import Case, Trial
from volprep.parts.compression.decision import (
    COLOUR_FORM,
    KIND,
    bits_per_voxel,
    choose_form,
    item_of,
    misfit,
    require_form,
)
from volprep.parts.compression.source_level import LevelData
from volprep.parts.compression.whole_colour import WholeColour
from volprep.parts.part import Part
from volprep.plan.decisions import CompressionChoice, Packed
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.plan.whole_source import WholeSource
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem


def with_blocks(cases: Sequence[Case], trial: Trial) -> Sequence[Case]:
    """Decide on blocks for the channels of a volume in colour; other channels stay as they are.

    Raises as `require_form`.
    """
    scene = cases[0].scene
    if scene.colour is None or scene.textures.compression == "none":
        return cases
    choice = _chosen(cases, trial)
    return [cases[0].plus(choice), *(case.plus(CompressionChoice(choice.form)) for case in cases[1:])]


def _chosen(cases: Sequence[Case], trial: Trial) -> CompressionChoice:
    first, sources = cases[0], [case.whole for case in cases if case.whole is not None]
    require_form(first.scene, first.profile)
    refusal = _why_not_tried(first, is_build=len(sources) == len(cases))
    if refusal is not None:
        return CompressionChoice(items=(refusal,))
    no_room = CompressionChoice(items=(misfit(COLOUR_FORM, first.profile),))
    try:
        laid_out = trial([case.plus(CompressionChoice(COLOUR_FORM)) for case in cases])
    except VolprepError as error:
        if error.code != "VP3022":
            raise
        return no_room
    packed = laid_out.cases[0].part(Packed)
    if packed is None or not packed.volumes:
        return no_room
    return _tried(sources, laid_out.channels, packed.volumes[0], first.scene)


def _why_not_tried(case: Case, *, is_build: bool) -> PlanItem | None:
    """Return the refusal if blocks are not even tried, else None."""
    profile = case.profile
    name = "compressed textures"
    if case.scene.textures.compression == "auto" and "astc-4x4-unorm" not in profile.texture_formats:
        reason = f"profile {profile.name} has no astc-4x4-unorm, the only form of a volume in colour"
    elif case.values.quantize.bits == 8:
        reason = "light is linear and has 8 bits here, and blocks of a volume in colour are sRGB"
    elif not is_build:
        name, bits_text = f"textures as {COLOUR_FORM}", f"{bits_per_voxel(COLOUR_FORM):.3g} bits a voxel"
        reason = f"{bits_text}; a build tries the whole level, and uses it within half of the tolerance"
    else:
        return None
    return PlanItem(name=name, kind=KIND, kept=False, reason=reason)


def _tried(
    sources: Sequence[WholeSource], plans: Sequence[ChannelPlan], volume: VolumePlan, scene: Scene
) -> CompressionChoice:
    """Try blocks on the finest level, `volume`, whose texels the channels of `plans` share."""
    data = [
        LevelData(
            level=plan.level(volume.level),
            crop=plan.crop,
            grid=plan.grid,
            quantize=plan.quantize,
            functions=plan.transfer_functions,
            render=scene.render,
            tolerance=scene.tolerance,
        )
        for plan in plans
    ]
    trial = WholeColour(sources, data).try_form(volume, COLOUR_FORM)
    return CompressionChoice(COLOUR_FORM if trial.kept else None, (item_of(trial),), (trial,))


def _plan(case: Case) -> Case:
    return case if case.part(CompressionChoice) else case.plus(choose_form(case))


def _items(_plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    yield from case.decided(CompressionChoice).items


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
            chosen_by=where_auto("textures.compression"),
            lossy=True,
        ),
    ),
)
