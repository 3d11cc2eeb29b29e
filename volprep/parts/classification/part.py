"""The part *classification*: turns values into colours."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from volprep.parts.ablation import AblationItem, always, where_auto
from volprep.parts.case import Case, Joint, Trial
from volprep.parts.classification.automatic import ClassificationChoice, choose_classification, describe_classification
from volprep.parts.classification.decision import (
    choose_tables,
    describe_tables,
    require_classification,
    require_isovalues,
    require_one_channel,
)
from volprep.parts.classification.stage import STAGE
from volprep.parts.part import Part, PlannedImage
from volprep.plan.decisions import Tables
from volprep.plan.item_kinds import BEYOND, TABLES
from volprep.plan.records import ChannelPlan, LookupPlan, PreintegratedPlan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import Manifest, PlanItem
from volprep_formats.package.program import WITH_TABLES

_FLIP, _KEPT_LIGHT = 0.1, 0.7
"""Of preclassified voxels, about: a phantom of shells and soft parts had FLIP 0.08 to 0.09, and kept 0.717."""


def _measure(cases: Sequence[Case], _trial: Trial) -> Sequence[Case]:
    """Choose how values become colours; all channels have the same way."""
    if not cases[0].classifications:
        return cases
    choice = choose_classification(cases)
    return [
        replace(case, scene=case.scene.with_classification(choice.name), decisions=(*case.decisions, choice))
        for case in cases
    ]


def _join(joint: Joint) -> Joint:
    tabled = [case.plus(choose_tables(case, joint.shared.rays.step_mm)) for case in joint.cases]
    choice = joint.cases[0].part(ClassificationChoice)
    return replace(joint, cases=tuple(tabled)).plus(items=describe_classification(choice))


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    yield from describe_tables(plan, case.decided(Tables))
    yield from _of_voxels(case.scene)


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


def _images(plan: ChannelPlan) -> Iterator[PlannedImage]:
    tables: tuple[LookupPlan | PreintegratedPlan, ...] = (*plan.lookups, *plan.preintegrated)
    for table in tables:
        yield PlannedImage(table.file, table.format, table.shape_zyx, table.transfer)


def _has_preintegrated(manifest: Manifest) -> bool | None:
    names = {program.classification for program in manifest.programs}
    return "preintegrated" in names if names <= WITH_TABLES else None


PART = Part(
    name="classification",
    prepare=require_one_channel,
    require=require_classification,
    begin=require_isovalues,
    measure=_measure,
    join=_join,
    items=_items,
    images=_images,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "pre-integrated table",
            TABLES[PreintegratedPlan],
            always("truth"),
            without={"render": {"classification": "lookup"}},
            added=lambda scene: None if scene.editable else {"render": {"classification": "preintegrated"}},
            stated=_has_preintegrated,
            chosen_by=where_auto("render.classification"),
            lossy=True,
        ),
    ),
)
