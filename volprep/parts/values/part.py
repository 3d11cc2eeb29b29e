"""The part *values*: codes of 8 or 16 bits, and the crop."""

from collections.abc import Iterator, Sequence

from volprep.parts.ablation import AblationItem, always, where_auto
from volprep.parts.case import Case, Trial
from volprep.parts.part import Part
from volprep.parts.values.decision import choose_values
from volprep.parts.values.items import BORDER_KIND, WIDE_KIND, describe_border, describe_codes
from volprep.parts.values.labels import require_distinct_labels
from volprep.parts.values.stage import STAGE
from volprep.plan.functions import describe_functions
from volprep.plan.records import ChannelPlan
from volprep_formats.package.manifest import Manifest, PlanItem


def _measure(cases: Sequence[Case], _trial: Trial) -> list[Case]:
    """Choose the codes of each channel. Raises VP3020, VP3021, VP3025 and VP3026 for codes that cannot be."""
    return [
        case.plus(choose_values(case.scene, case.profile, case.info, case.measured, case.functions)) for case in cases
    ]


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    yield from describe_codes(plan, case.scene, case.values)
    yield from describe_functions(case.scene, plan.transfer_functions)


def _has_border(manifest: Manifest) -> bool | None:
    if all(item.kind != BORDER_KIND for item in manifest.plan):
        return None
    return manifest.grid is not None and manifest.grid.shape_zyx == manifest.source.info.grid.shape_zyx


def _has_wide_codes(manifest: Manifest) -> bool | None:
    labels = any(texture.filter == "nearest" for texture in manifest.textures_of("volume"))
    return None if labels or manifest.quantization is None else manifest.quantization.bits == 16


PART = Part(
    name="values",
    devices="any",
    begin=require_distinct_labels,
    measure=_measure,
    join=lambda joint: joint.plus(items=describe_border(joint.shared, joint.scene, joint.cases[0].info)),
    items=_items,
    stages=(STAGE,),
    ablations=(
        AblationItem(
            "empty border",
            BORDER_KIND,
            always("wish"),
            without={"crop": "auto"},
            added=lambda _: {"crop": "none"},
            stated=_has_border,
            with_everything=True,
        ),
        AblationItem(
            "16-bit values",
            WIDE_KIND,
            lambda scene: "wish" if scene.quantize.bits == 16 else "truth",
            without={"quantize": {"bits": 8}},
            added=lambda _: {"quantize": {"bits": 16}},
            stated=_has_wide_codes,
            chosen_by=where_auto("quantize.bits"),
            lossy=True,
            with_everything=True,
        ),
    ),
)
