"""The part *editing*: data for apps whose users edit transfer functions, and what such packages cannot have.

If transfer functions are fixed, the plan leaves out everything that they do not show. If they may change, only tables
that can be rebuilt may depend on them: no crop, no values without codes, no filter, mesh or voxel that shows one
function only.
"""

from collections.abc import Iterator

from volprep.compositing import COMPOSITINGS
from volprep.parts.ablation import AblationItem, always, by_the_scene
from volprep.parts.case import Case
from volprep.parts.levels.joint_histogram import reference_mm
from volprep.parts.levels.level_input import BY_LOOKS
from volprep.parts.part import Part
from volprep.plan.products import EditingPlan
from volprep.plan.records import LevelPlan
from volprep.scene.scene import Scene
from volprep.scene.wishes import refuse_any, refuse_wishes
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.editing.record import BINS, JointHistogram
from volprep_formats.package.profile import DeviceProfile

KIND = "joint-histograms"
"""Kind of its item of the plan."""
_HEADROOM = 4.0
"""Optical depth of a voxel, 98 % opacity, that tables of 8 bits leave room for: their scale is constant in shaders."""


def for_edits(scene: Scene, _profile: DeviceProfile, _channels: int) -> Scene:
    """Return the scene with the wishes that editing brings, if it is to be editable. Raises VP3080 for others."""
    if not scene.editable:
        return scene
    frozen = {
        f"classification {scene.render.classification}": scene.render.classification != "lookup",
        f"pyramid.filter {scene.pyramid.filter}": scene.pyramid.filter in BY_LOOKS,
    }
    refuse_any("VP3080", frozen)
    refuse_wishes("VP3080", scene, ("[proxy]",))
    skip = scene.skip.model_copy(update={"ranges": scene.skip.kind != "none"})
    return scene.model_copy(update={"crop": "none", "skip": skip})


def plan_editing(scene: Scene, grid: Grid, levels: tuple[LevelPlan, ...]) -> EditingPlan | None:
    """Decide which levels have a joint histogram: all coarser ones, unless they hold labels, which nothing mixes."""
    if not scene.editable:
        return None
    mixes = not COMPOSITINGS[scene.render.compositing].level_filters and not scene.source.labels
    coarser = [level for level in levels if level.index > 0 and mixes]
    return EditingPlan(
        histograms=tuple(
            JointHistogram(
                level=level.index,
                file=f"histograms/{level.name}.bin",
                channel=level.channel,
                reference_mm=reference_mm(grid.coarser(level.factors_zyx).spacing_mm_zyx),
            )
            for level in coarser
        ),
        headroom_per_mm=_HEADROOM / min(grid.spacing_mm_zyx),
    )


def describe_editing(plan: EditingPlan | None) -> Iterator[PlanItem]:
    """Return the data that the package holds for edits of transfer functions, if users make them."""
    if plan is None:
        return
    if plan.histograms:
        yield PlanItem(
            name="joint histograms",
            kind=KIND,
            kept=True,
            reason="users edit transfer functions: one matrix-vector product gives a level's table for any function; "
            "filters of levels and these matrices depend on no function",
            files=tuple(histogram.file for histogram in plan.histograms),
            size_bytes=len(plan.histograms) * 2 * BINS * (BINS + 2),
        )
    else:
        reason = "no level needs one: each is drawn with the table of the transfer function itself"
        yield PlanItem(name="joint histograms", kind=KIND, kept=False, reason=reason)


def _plan(case: Case) -> Case:
    return case.plus(plan_editing(case.scene, case.grid, case.layout.levels))


PART = Part(
    name="editing",
    prepare=for_edits,
    plan=_plan,
    items=lambda plan, _case: describe_editing(plan.part(EditingPlan)),
    ablations=(
        AblationItem(
            "what edits need",
            KIND,
            always("wish"),
            without={"editable": False},
            # No filter may rest on a transfer function.
            added=lambda _: {"editable": True, "pyramid": {"filter": "box"}},
            stated=lambda manifest: manifest.editing is not None,
            chosen_by=by_the_scene,
            lossy=True,
        ),
    ),
)
