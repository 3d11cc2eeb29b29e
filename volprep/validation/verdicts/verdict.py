"""Decide whether a package may ship: it follows from the scan, and looks right within the scene's tolerance."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated

from pydantic import Field

from volprep.plan.level_choice import WORSE_THAN_MEANS
from volprep.truth.verdict_code import VerdictCode
from volprep.validation.results.measurements import ErrorNumbers, ProgramResult, ViewResult
from volprep.validation.results.seen import FullSize, NonNegative, OtherDrawing, OtherView, SeenNumbers
from volprep.validation.verdicts.outcomes import (
    FinestOutcome,
    LevelOutcome,
    finest_outcome,
    level_outcomes,
    settled_views,
)
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Tolerance
from volprep_formats.record import Record

# A tolerance of 0 asks for equality; float32 pictures cannot resolve a smaller difference.
_SMALLEST_TOLERANCE = 1e-7
_MOST_SHIFT_VOXELS = 0.25
"""Levels that are right were shifted by 0.00 to 0.06 voxels, a level begun half a voxel too early by 0.3 and more."""
_ROUNDING_RMSE = 0.5 / 255
"""Beside WORSE_THAN_MEANS a level may be worse by what a target of 8 bits rounds."""
_ROUNDING_FLIP = 0.01
_ROUNDING_KEPT = 0.05


class Verdict(Record):
    """Whether the package may ship, and the view that is closest to its limit or furthest beyond it."""

    code: VerdictCode
    """Whether the package may ship, in a word."""
    views: Count
    """Number of pictures that were judged."""
    failed: Annotated[int, Field(ge=0)]
    """Number of pictures beyond the tolerance."""
    changed: tuple[str, ...] = ()
    """Programs whose skip table or mesh changes a picture, which is a defect whatever the tolerance."""
    differing: tuple[str, ...] = ()
    """Items that do not follow from scene and scan."""
    shifted: tuple[str, ...] = ()
    """Coarse levels that are shifted by more than a quarter of a voxel, which is a defect whatever the tolerance."""
    worse: tuple[str, ...] = ()
    """Coarse levels that are worse than the box reference, which is a defect whatever the tolerance."""
    beyond: tuple[str, ...] = ()
    """Coarse levels, pieces of level 0, edits and cuts with a view beyond the tolerance; not levels for previews that
    the box reference excuses, unless they lose a segment."""
    finest: tuple[FinestOutcome, ...] = ()
    """The finest level of each program."""
    levels: tuple[LevelOutcome, ...] = ()
    """Each coarse level: whether it is within its tolerance, what it has lost, and the size that it is usable to."""
    unwitnessed: tuple[str, ...] | None = None
    """What no second renderer or reader has seen, with the reasons; null if none was asked."""
    unproved: tuple[str, ...] = ()
    """Parts of the package that no picture has judged."""
    disagreeing: tuple[str, ...] = ()
    """Programs whose pictures, or whose truth, a second renderer does not agree with."""
    contradicted: tuple[str, ...] = ()
    """Facts that a second reading with independent libraries contradicts."""
    unlike_paths: tuple[str, ...] = ()
    """Programs whose precomputed light is further from path tracing than the tolerance."""
    worst_program: str
    """Program of the worst view."""
    worst_view: str
    """The worst view: the one with the largest share of a tolerance."""
    worst_rmse: NonNegative
    """Its root mean square error over seen pixels."""
    worst_maximum: NonNegative
    """Its largest error."""
    worst_flip: NonNegative
    """Its FLIP."""
    worst_kept_light: float | None
    """Light that the thing keeps at most, given the uncertainty, that keeps the least in it; null without things."""
    worst_data_rmse: NonNegative | None
    """Part of its root mean square error over seen pixels that is due to level and quantisation; null for a picture
    from bricks on demand."""
    worst_drawing_rmse: NonNegative | None
    """Part of its root mean square error over seen pixels that is due to the renderer; null as above."""
    share: NonNegative
    """The largest share of a limit of the tolerance that it takes; above 1 it fails."""

    @property
    def passed(self) -> bool:
        """Whether the package may ship."""
        return self.code == "within"


def passes(found: SeenNumbers, tolerance: Tolerance) -> bool:
    """Return whether everything that the tolerance limits is within it."""
    return (
        found.rmse <= tolerance.rmse
        and found.maximum <= tolerance.maximum
        and found.flip <= tolerance.flip
        and (tolerance.kept_light == 0.0 or _lost_at_least(found) <= 1.0 - tolerance.kept_light)
    )


def passes_errors(found: ErrorNumbers, tolerance: Tolerance) -> bool:
    """Return whether RMSE over seen pixels and largest error are within the tolerance; FLIP and things do not count."""
    return found.seen_rmse <= tolerance.rmse and found.maximum <= tolerance.maximum


def share_of(found: SeenNumbers, tolerance: Tolerance) -> float:
    """Return the largest share of a limit of the tolerance; above 1 is beyond it."""
    lost = _lost_at_least(found) / max(1.0 - tolerance.kept_light, _SMALLEST_TOLERANCE)
    return max(
        share_of_errors(found.rmse, found.maximum, tolerance),
        found.flip / max(tolerance.flip, _SMALLEST_TOLERANCE),
        lost if tolerance.kept_light > 0.0 else 0.0,
    )


def _lost(found: SeenNumbers) -> float:
    return 0.0 if found.kept_light is None else 1.0 - found.kept_light


def _lost_at_least(found: SeenNumbers) -> float:
    """Return the light that a thing has surely lost: a smaller loss than the scatter around it is not seen."""
    return 0.0 if found.kept_light_at_most is None else 1.0 - found.kept_light_at_most


def share_of_errors(rmse: float, maximum: float, tolerance: Tolerance) -> float:
    """Return the larger share of a root mean square error over seen pixels and of a largest error."""
    return max(rmse / max(tolerance.rmse, _SMALLEST_TOLERANCE), maximum / max(tolerance.maximum, _SMALLEST_TOLERANCE))


def is_worse(level: OtherView, finest: SeenNumbers) -> bool:
    """Return whether a view of a coarse level is worse than the box reference; false if that was not drawn.

    Light of thin things is compared in pictures as large as the report's, RMSE and FLIP where a voxel is a pixel.
    The reference has the scan's own values and no steps. So a level may be worse by what codes and steps make of the
    `finest` level in this view, by rounding, and by the uncertainty of its kept light.
    """
    seen, box = level.seen, level.box
    if box is None:
        return False
    return (
        seen.rmse > WORSE_THAN_MEANS * box.rmse + finest.rmse + _ROUNDING_RMSE
        or seen.flip > WORSE_THAN_MEANS * box.flip + finest.flip + _ROUNDING_FLIP
        or _keeps_less(level.full, level.box_full, finest)
    )


def _keeps_less(level: FullSize | None, box: FullSize | None, finest: SeenNumbers) -> bool:
    """Return whether a level keeps less light; light that is lost altogether cannot become less.

    Box means keep nothing for certain where the uncertainty of their light is larger than it: specks beside the rim of
    a brain had 1.6 ± 3.4 of it.
    """
    if level is None or box is None or level.kept_light_at_most is None or box.kept_light is None:
        return False
    within = (box.kept_light_at_most or box.kept_light) - box.kept_light
    certain = box.kept_light if box.kept_light > within else 0.0
    kept, of_box = (min(max(value, 0.0), 1.0) for value in (level.kept_light_at_most, certain))
    return kept < of_box - max(_lost(finest), 0.0) - _ROUNDING_KEPT


def may_be_preview(boxes: Sequence[SeenNumbers], tolerance: Tolerance) -> bool:
    """Return whether the box reference is beyond the tolerance in a view: then a level may be for previews only.

    The level itself does not matter, nor does its mark: without a reference it is judged as any other. The reference
    counts as a level that is as much worse as it may be: where one had 0.0963 of 0.1, a level with 0.102 was a fault.
    """
    worse = {"rmse": tolerance.rmse / WORSE_THAN_MEANS, "flip": tolerance.flip / WORSE_THAN_MEANS}
    allowed = tolerance.model_copy(update={"maximum": 1.0, **worse})
    return any(not passes(box, allowed) for box in boxes)


def judge(
    programs: Sequence[ProgramResult],
    tolerance: Tolerance,
    *,
    differing: Sequence[str] = (),
    unproved: Sequence[str] = (),
    disagreeing: Sequence[str] = (),
    contradicted: Sequence[str] = (),
    unwitnessed: Sequence[str] | None = None,
) -> Verdict:
    """Judge all views of `programs` (at least one view) and name the worst. The first of equals is the worst.

    `differing` are items that do not follow from the scan, `unproved` items that no picture has judged, `disagreeing`
    programs that a second renderer disagrees with, `contradicted` facts that a second reading contradicts, and
    `unwitnessed` is what neither has seen; None if none was asked.
    """
    views = [(program.program, view) for program in programs for view in settled_views(program)]
    worst_program, worst = max(views, key=lambda item: share_of(item[1].seen, tolerance))
    # A picture from bricks is among the parts.
    failed = sum(not view.passed for program in programs if program.settled is None for view in program.views)
    changed = tuple(
        program.program for program in programs if program.empty_space is not None and not program.empty_space.passed
    )
    unlike = tuple(program.program for program in programs if any(not light.passed for light in program.traced_lights))
    others = [other for program in programs for other in program.others]
    settled = [
        program.settled.item
        for program in programs
        if program.settled is not None and _beyond_views(program, tolerance)
    ]
    parts = [other.item for other in others if not other.passed and (other.loses_segments or not other.excused)]
    beyond = tuple(dict.fromkeys([*settled, *parts]))
    shifted = _items(other for other in others if other.shift_voxels > _MOST_SHIFT_VOXELS)
    worse = _items(other for program in programs for other in program.others if _has_worse_view(other, program))
    return Verdict(
        code=_code(
            {
                "differs": differing,
                "unproved": unproved,
                "contradicted": contradicted,
                "beyond": failed,
                "changed": changed,
                "disagrees": disagreeing,
                "unlike-paths": unlike,
                "shifted": shifted,
                "worse-than-box": worse,
                "part-beyond": beyond,
            }
        ),
        views=len(views),
        failed=failed,
        changed=changed,
        differing=tuple(differing),
        shifted=shifted,
        worse=worse,
        beyond=beyond,
        finest=tuple(finest_outcome(program, _beyond_views(program, tolerance)) for program in programs),
        levels=level_outcomes(programs, tolerance),
        unwitnessed=None if unwitnessed is None else tuple(unwitnessed),
        unproved=tuple(unproved),
        disagreeing=tuple(disagreeing),
        contradicted=tuple(contradicted),
        unlike_paths=unlike,
        worst_program=worst_program,
        worst_view=worst.view,
        worst_rmse=worst.seen.rmse,
        worst_maximum=worst.seen.maximum,
        worst_flip=worst.seen.flip,
        worst_kept_light=worst.seen.kept_light_at_most,
        worst_data_rmse=worst.data.seen_rmse if isinstance(worst, ViewResult) else None,
        worst_drawing_rmse=worst.drawing.seen_rmse if isinstance(worst, ViewResult) else None,
        share=share_of(worst.seen, tolerance),
    )


def _beyond_views(program: ProgramResult, tolerance: Tolerance) -> int:
    """Count the views beyond the tolerance.

    The bound that a picture states for its missing bricks excuses nothing: it only has to hold.
    """
    if program.settled is None:
        return sum(not view.passed for view in program.views)
    return sum(not passes(view.seen, tolerance) for view in program.settled.views)


def _code(faults: Mapping[VerdictCode, object]) -> VerdictCode:
    """Return the first fault, or "within" if there is no fault."""
    return next((code for code, fault in faults.items() if fault), "within")


def _has_worse_view(other: OtherDrawing, program: ProgramResult) -> bool:
    finest = {view.view: view.seen for view in program.views}
    return any(view.view in finest and is_worse(view, finest[view.view]) for view in other.views)


def _items(others: Iterable[OtherDrawing]) -> tuple[str, ...]:
    """Return the drawings, each once: two programs may draw one level."""
    return tuple(dict.fromkeys(other.item for other in others))
