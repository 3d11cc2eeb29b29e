"""Judging a package."""

import pytest

from volprep.validation.records import ErrorNumbers, Report
from volprep.validation.verdict import judge, passes, share_of
from volprep_formats.package.manifest import Tolerance


def errors(rmse: float, maximum: float) -> ErrorNumbers:
    return ErrorNumbers(
        rmse=rmse, maximum=maximum, psnr_black_db=None, psnr_white_db=None, ssim_black=1.0, ssim_white=1.0
    )


@pytest.mark.parametrize(
    ("rmse", "maximum", "expected"),
    [(0.02, 0.25, True), (0.0200001, 0.25, False), (0.02, 0.2500001, False), (0.0, 0.0, True)],
)
def test_a_view_passes_only_if_both_errors_are_within(rmse, maximum, expected) -> None:
    assert passes(errors(rmse, maximum), Tolerance(rmse=0.02, maximum=0.25)) is expected


def test_the_share_is_that_of_the_error_which_is_closer_to_its_limit() -> None:
    tolerance = Tolerance(rmse=0.02, maximum=0.25)
    assert share_of(errors(0.01, 0.2), tolerance) == pytest.approx(0.8)
    assert share_of(errors(0.04, 0.2), tolerance) == pytest.approx(2.0)


def test_a_tolerance_of_nothing_passes_equal_pictures_only() -> None:
    nothing = Tolerance(rmse=0.0, maximum=0.0)
    assert passes(errors(0.0, 0.0), nothing)
    assert share_of(errors(0.0, 0.0), nothing) == 0.0
    assert not passes(errors(1e-6, 1e-6), nothing)
    assert share_of(errors(1e-6, 1e-6), nothing) > 1.0


def test_the_verdict_names_the_worst_view_and_counts_the_failed(report: Report) -> None:
    (program,) = report.programs
    tolerance = Tolerance(rmse=0.0055, maximum=0.25)
    judged = [view.model_copy(update={"passed": passes(view.total, tolerance)}) for view in program.views]
    other = program.model_copy(update={"program": "other", "views": tuple(judged[:1])})
    verdict = judge((other, program.model_copy(update={"views": tuple(judged)})), tolerance)
    assert (verdict.passed, verdict.failed, verdict.views) == (False, 1, 4)
    assert (verdict.worst_program, verdict.worst_view) == ("raycast", "superior")
    assert (verdict.worst_rmse, verdict.worst_maximum) == (0.006, 0.048)
    assert verdict.share == pytest.approx(0.006 / 0.0055)
