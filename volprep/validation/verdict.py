"""Whether a package may ship: it follows from the scan, and every view is within the scene's tolerance."""

from collections.abc import Sequence

from volprep.plan.form_trial import FormTrial
from volprep.validation.records import ErrorNumbers, OtherDrawing, PreviewOutcome, ProgramResult, Verdict
from volprep_formats.package.manifest import Tolerance

# A tolerance of 0 asks for equality; float32 pictures cannot tell less than this apart.
_SMALLEST_TOLERANCE = 1e-7


def passes(total: ErrorNumbers, tolerance: Tolerance) -> bool:
    """Return whether one view's total error is within the tolerance, in rmse and in maximum."""
    return total.rmse <= tolerance.rmse and total.maximum <= tolerance.maximum


def share_of(total: ErrorNumbers | FormTrial, tolerance: Tolerance) -> float:
    """Return the error over the tolerance, the larger of rmse's and maximum's; above 1 is beyond it."""
    return max(
        total.rmse / max(tolerance.rmse, _SMALLEST_TOLERANCE),
        total.maximum / max(tolerance.maximum, _SMALLEST_TOLERANCE),
    )


def judge(
    programs: Sequence[ProgramResult],
    tolerance: Tolerance,
    differing: Sequence[str] = (),
    unproved: Sequence[str] = (),
    disagreeing: Sequence[str] = (),
) -> Verdict:
    """Judge all views of `programs` (at least one view) and name the worst. Of equals the first is the worst.

    `differing` are items that do not follow from the scan, `unproved` those that nothing has judged,
    `disagreeing` programs that a second renderer does not agree with.
    """
    views = [(program.program, view) for program in programs for view in program.views]
    worst_program, worst = max(views, key=lambda item: share_of(item[1].total, tolerance))
    failed = sum(not view.passed for _, view in views)
    changed = tuple(each.program for each in programs if each.empty_space is not None and not each.empty_space.passed)
    others = [other for each in programs for other in each.others]
    beyond = tuple(other.item for other in others if not other.passed and not other.preview_only)
    told: dict[str, OtherDrawing] = {}
    for other in others:
        # Two programs may draw one level: the worse of them counts.
        if other.preview_only and (other.item not in told or other.rmse >= told[other.item].rmse):
            told[other.item] = other
    previews = tuple(PreviewOutcome(item=name, rmse=other.rmse, within=other.passed) for name, other in told.items())
    return Verdict(
        passed=not (failed or changed or differing or beyond or unproved or disagreeing),
        views=len(views),
        failed=failed,
        changed=changed,
        differing=tuple(differing),
        beyond=beyond,
        previews=previews,
        unproved=tuple(unproved),
        disagreeing=tuple(disagreeing),
        worst_program=worst_program,
        worst_view=worst.view,
        worst_rmse=worst.total.rmse,
        worst_maximum=worst.total.maximum,
        worst_data_rmse=worst.data.rmse,
        worst_drawing_rmse=worst.drawing.rmse,
        share=share_of(worst.total, tolerance),
    )
