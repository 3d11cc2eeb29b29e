"""The part *flattened*: one value for the voxels that no picture can show."""

from collections.abc import Iterator

import numpy as np

from volprep.parts.ablation import AblationItem, always, where_auto
from volprep.parts.case import Case
from volprep.parts.part import Part
from volprep.parts.skip.decision import measured_occupied
from volprep.parts.skip.part import found_of
from volprep.plan.products import FlattenedPlan
from volprep.scene.scene import Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.program import LAID_OVER
from volprep_formats.textures.block_formats import BLOCKS

KIND = "flattened"
"""Kind of its item of the plan."""
LEAST_SHARE = 0.05
"""Share of the volume that must be empty: below it a texture saves less than a hundredth on its way."""
_COMPOSITINGS = LAID_OVER | {"maximum"}
"""Compositings whose pictures depend on no value beside a sample that shows something."""
_CLASSIFICATIONS = frozenset(("lookup", "palette", "control-points"))
"""Classifications of single samples: a pre-integrated segment depends on the value where it begins, seen or not."""
_CELL, _GRADIENT = 1, 2
"""Voxels that a visible sample reads on each side of its own: the corners of its cell, and of the neighbouring
cells."""


def plan_flattened(case: Case) -> FlattenedPlan | None:
    """Decide whether the levels of a channel are flattened."""
    if _obstacle(case) is not None:
        return None
    share = _empty_share(case)
    if share < LEAST_SHARE:
        return None
    scene = case.scene
    differences = scene.render.lighting != "none" and scene.lighting.normals != "volume"
    return FlattenedPlan(reach=_GRADIENT if differences else _CELL, share=share)


def _empty_share(case: Case) -> float:
    """Return the share of the measured blocks, of 16³ voxels, in which no transfer function shows anything."""
    found = found_of(case)
    occupied = [measured_occupied(function, 0.0, found) for function in case.functions]
    return 1.0 - float(np.any(occupied, axis=0).mean())


def _obstacle(case: Case) -> str | None:
    """Return why voxels keep their values whatever the scan holds; None if they may be flattened."""
    return next((reason for reason, holds in _obstacles(case.scene, case) if holds), None)


def _obstacles(scene: Scene, case: Case) -> Iterator[tuple[str, bool]]:
    render, finest = scene.render, case.layout.volumes[0]
    yield 'the scene does not ask for it: lab.textures.flatten is "none"', scene.textures.flatten == "none"
    yield "users may edit transfer functions", scene.editable or scene.skip.ranges
    yield "labels keep their numbers", bool(scene.source.labels)
    yield (
        f"compositing {render.compositing} depends on values beside those that it shows",
        (render.compositing not in _COMPOSITINGS),
    )
    yield (
        f"classification {render.classification} reads values beside those that it shows",
        (render.classification not in _CLASSIFICATIONS),
    )
    yield "bricks that show nothing are not stored at all", finest.bricks is not None
    yield "sub-volumes hold the values of the scan", scene.grid is not None
    yield "between two mipmaps a sample mixes two levels", finest.mipmap is not None
    yield "compressed blocks are judged as they are", finest.format in BLOCKS
    yield "channels share texels", scene.together is not None or scene.textures.channels == "packed"


def describe_flattened(plan: FlattenedPlan | None, case: Case) -> Iterator[PlanItem]:
    """Say whether voxels are flattened, and why."""
    if plan is None:
        reason = _obstacle(case) or (
            f"{_empty_share(case):.1%} of the volume is empty, in blocks of 16³ voxels; below {LEAST_SHARE:.0%} it "
            "saves little"
        )
        yield PlanItem(name="flattened voxels", kind=KIND, kept=False, reason=reason)
        return
    yield PlanItem(
        name="flattened voxels",
        kind=KIND,
        kept=True,
        reason=f"at least {plan.share:.1%} of the volume is empty: voxels at least {plan.reach + 1} voxels from what a "
        'transfer function shows get one value, so that textures compress better; lab.textures.flatten = "none" '
        "keeps the values of the scan",
    )


def _plan(case: Case) -> Case:
    return case.plus(plan_flattened(case))


PART = Part(
    name="flattened",
    plan=_plan,
    items=lambda plan, case: describe_flattened(plan.part(FlattenedPlan), case),
    ablations=(
        AblationItem(
            "flattened voxels",
            KIND,
            always("transport"),
            without={"textures": {"flatten": "none"}},
            added=lambda _: {"textures": {"flatten": "auto"}},
            chosen_by=where_auto("textures.flatten"),
        ),
    ),
)
