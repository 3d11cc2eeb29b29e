"""`classification = "auto"`: the kind that draws this scan with the least error in the same time.

Errors are measured on rays of the scan, as steps are (`parts/programs/step_bench.py`), each kind with what its shader
reads: lookup tables of the length that the plan gives them, segments of straight values, control points themselves.
Time is counted, not clocked, so that the same scan gives the same package: a ray costs its samples times what one of
them costs.

Where the plan chooses the step, each kind gets the longest one that keeps the promise, and the fastest one wins. Where
the scene states the step, or no step keeps the promise, all get the time of lookup tables, and the least error wins.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case
from volprep.parts.programs.patch_rays import PatchRays
from volprep.parts.programs.source_rays import SourceRays
from volprep.parts.programs.step import MARGIN_OF_VIEWS, has_error_of_steps, layers_of, source_rays
from volprep.parts.programs.step_bench import LongestStep, StepBench, in_voxels, longest_step
from volprep.plan.probe import PictureDifference
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.program import ClassificationName
from volprep_formats.package.transfer_function import TransferFunction

KIND = "classification"
"""Kind of its item of the plan."""
_SEGMENT = 1.55
"""Cost of a pre-integrated segment, in samples with a lookup table. Nine fetches in place of two took 1.40 to 1.61
times the time (llvmpipe, time of the processor, 3D textures and mosaics, unlit and lit)."""
_FIRST_POINT, _NEXT_POINT = 0.6, 0.012
"""Cost of a sample by control points: 2 to 16 points took 0.61 to 0.97 times the time of a table, 64 points 1.12 to
1.56 times (as above)."""
_FIRST_POINT_OF_SEGMENTS, _NEXT_POINT_OF_SEGMENTS = 0.75, 0.004
"""The same with segments, whose labels cost the same either way: 2 points of both styles took 0.76 to 0.96 times the
time of tables, 64 points 0.96 to 1.00 times (as above, 36 % of the cells with several labels)."""
_CLEARLY = 0.9
"""Another kind than lookup tables must take less than this part of the time, or of the error: costs are no more exact
than that from driver to driver."""


@dataclass(frozen=True)
class ClassificationChoice:
    """How values become colours."""

    name: ClassificationName
    """The kind."""
    reason: str
    """Why, for people."""


def choose_classification(cases: Sequence[Case]) -> ClassificationChoice:
    """Choose one of the classifications that the scene may have, where it wants "auto"."""
    scene, kinds = cases[0].scene, cases[0].classifications
    if reason := _unmeasured(cases):
        return ClassificationChoice(kinds[0], reason)
    (case,), with_segments = cases, scene.segments is not None
    has_levels = max(case.grid.shape_zyx) > scene.pyramid.coarsest_longest_axis
    if has_levels and not with_segments:
        # A level whose table was fitted has 0.6 to 0.8 times the error of one with the common function (GUIDE).
        kinds = tuple(kind for kind in kinds if kind != "control-points")
    voxel_mm = min(case.grid.spacing_mm_zyx)
    of_views = case.part(SourceRays)
    rays = of_views.finest if of_views else [source_rays(scene, case.info, case.measured, case.grid)]
    benches = {kind: _bench(kind, case, rays) for kind in kinds}
    if not benches[kinds[0]].sees:
        return ClassificationChoice(kinds[0], "no ray of a sample sees anything, so that nothing was measured")
    costs = {kind: _cost(kind, case.functions, with_segments=with_segments) for kind in kinds}
    step = scene.render.step_voxels
    if step != "auto":
        return _most_exact(benches, costs, step, voxel_mm)
    usual = COMPOSITINGS[scene.render.compositing].step_voxels
    margin = MARGIN_OF_VIEWS if of_views else 1.0
    steps = {kind: longest_step(bench, voxel_mm, scene.tolerance, usual, margin) for kind, bench in benches.items()}
    if not any(found.keeps for found in steps.values()):
        return _most_exact(benches, costs, steps[kinds[0]].voxels, voxel_mm)
    return _fastest(benches, costs, steps, voxel_mm)


def describe_classification(choice: ClassificationChoice | None) -> list[PlanItem]:
    """Return the item of the plan, if the scene leaves the choice to it."""
    if choice is None:
        return []
    return [PlanItem(name="classification", kind=KIND, kept=True, reason=f"{choice.name}: {choice.reason}")]


def _unmeasured(cases: Sequence[Case]) -> str | None:
    """Return why nothing is measured; None if it is."""
    scene, kinds = cases[0].scene, cases[0].classifications
    reasons = {
        "several channels share tables in one picture": len(cases) > 1,
        "the scene allows no other kind": len(kinds) == 1,
        "rays of the scan do not tell which error a step makes": not has_error_of_steps(
            scene.with_classification(kinds[0])
        ),
    }
    return next((reason for reason, holds in reasons.items() if holds), None)


def _bench(kind: ClassificationName, case: Case, rays: Sequence[PatchRays]) -> StepBench:
    exact = [Table.exact(function) for function in case.functions]
    window, entries = case.values.quantize.window, case.values.entries
    render = case.scene.render
    return StepBench(
        COMPOSITINGS[render.compositing],
        exact,
        rays,
        is_segments=kind == "preintegrated",
        layers=layers_of(render.technique, case.profile),
        drawn=[table.resampled(window, entries) for table in exact] if kind == "lookup" else (),
    )


def _cost(kind: ClassificationName, functions: Sequence[TransferFunction], *, with_segments: bool) -> float:
    """Return the cost of a sample, in samples with a lookup table for each function."""
    if kind == "lookup":
        return 1.0
    if kind == "preintegrated":
        return _SEGMENT
    first, following = _FIRST_POINT, _NEXT_POINT
    if with_segments:
        first, following = _FIRST_POINT_OF_SEGMENTS, _NEXT_POINT_OF_SEGMENTS
    return first + following * (max(len(function.points) for function in functions) - 1)


def _fastest(
    benches: Mapping[ClassificationName, StepBench],
    costs: Mapping[ClassificationName, float],
    steps: Mapping[ClassificationName, LongestStep],
    voxel_mm: float,
) -> ClassificationChoice:
    """Choose the kind whose longest step that keeps the promise takes the least time."""
    times = {kind: costs[kind] / found.voxels for kind, found in steps.items() if found.keeps}
    best = min(times, key=times.__getitem__)
    first = next(iter(benches))
    if first in times and times[best] > _CLEARLY * times[first]:
        best = first
    others = [
        f"{kind} {in_voxels(found.voxels)} ({costs[kind] / found.voxels:.2g})" if found.keeps else f"{kind} none"
        for kind, found in steps.items()
        if kind != best
    ]
    errors = _errors(benches, costs, times[best], voxel_mm)
    return ClassificationChoice(
        best,
        f"steps of {in_voxels(steps[best].voxels)} keep the promise, at the cost of {times[best]:.2g} lookups a voxel; "
        f"{', '.join(others)}; in that time a sample of rays is off by {_listed(errors, best)}",
    )


def _most_exact(
    benches: Mapping[ClassificationName, StepBench],
    costs: Mapping[ClassificationName, float],
    voxels: float,
    voxel_mm: float,
) -> ClassificationChoice:
    """Choose the kind that is most exact in the time that lookup tables take with a step."""
    errors = _errors(benches, costs, 1.0 / voxels, voxel_mm)
    best = min(errors, key=lambda kind: errors[kind].rmse)
    first = next(iter(errors))
    if errors[best].rmse > _CLEARLY * errors[first].rmse:
        best = first
    return ClassificationChoice(
        best,
        f"in the time of lookup tables with steps of {in_voxels(voxels)} a sample of rays is off by "
        f"{_listed(errors, best)}",
    )


def _errors(
    benches: Mapping[ClassificationName, StepBench],
    costs: Mapping[ClassificationName, float],
    lookups_per_voxel: float,
    voxel_mm: float,
) -> dict[ClassificationName, PictureDifference]:
    """Return the error of each kind in a time, given in samples with a lookup table for each voxel."""
    return {kind: bench.error(costs[kind] / lookups_per_voxel * voxel_mm) for kind, bench in benches.items()}


def _listed(errors: Mapping[ClassificationName, PictureDifference], best: ClassificationName) -> str:
    others = [f"{kind} {error.text}" for kind, error in errors.items() if kind != best]
    return "; ".join((f"{best} {errors[best].text}", *others))
