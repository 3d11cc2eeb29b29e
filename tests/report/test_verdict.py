"""Judging a package."""

import pytest
from sample_report import in_full, level_drawing, level_view, report_of, seen

from volprep.validation.results.report import Report
from volprep.validation.verdicts.verdict import is_worse, judge, may_be_preview, passes, share_of
from volprep_formats.package.manifest import LevelTolerance, Tolerance

LIMITS = Tolerance(rmse=0.01, maximum=0.25, flip=0.03, kept_light=0.75)


def with_others(report: Report, *others):
    """The verdict of the report's program if it draws these."""
    (program,) = report.programs
    return judge([program.model_copy(update={"others": others})], report.tolerance)


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        (seen(0.01, maximum=0.25, flip=0.03, kept=0.75), True),
        (seen(0.0100001, maximum=0.25), False),
        (seen(0.01, maximum=0.2500001), False),
        (seen(0.01, flip=0.0300001), False),
        (seen(0.01, kept=0.7499999), False),
        # A loss that the scatter of the background explains is not seen. At the finest level this is little.
        (seen(0.002, kept=0.685, within=0.09), True),
        (seen(0.002, kept=0.685, within=0.06), False),
    ],
)
def test_a_view_passes_only_if_all_four_numbers_are_within(numbers, expected) -> None:
    assert passes(numbers, LIMITS) is expected
    assert (share_of(numbers, LIMITS) <= 1.0) is expected


def test_the_share_is_that_of_the_number_which_is_closest_to_its_limit() -> None:
    assert share_of(seen(0.005, maximum=0.2), LIMITS) == pytest.approx(0.8)
    assert share_of(seen(0.005, flip=0.06), LIMITS) == pytest.approx(2.0)
    assert share_of(seen(0.002, kept=0.85), LIMITS) == pytest.approx(0.6)


def test_a_tolerance_of_nothing_passes_equal_pictures_only() -> None:
    nothing = Tolerance(rmse=0.0, maximum=0.0, flip=0.0, kept_light=1.0)
    assert passes(seen(0.0, flip=0.0), nothing)
    assert share_of(seen(0.0, flip=0.0), nothing) == 0.0
    assert not passes(seen(1e-6, flip=0.0), nothing)
    assert share_of(seen(1e-6, flip=0.0), nothing) > 1.0


def test_the_verdict_names_the_worst_view_and_counts_the_failed() -> None:
    tolerance = Tolerance(rmse=0.0055)
    verdict = report_of((0.002, 0.003, 0.0025), tolerance).verdict
    assert (verdict.code, verdict.passed, verdict.failed, verdict.views) == ("beyond", False, 1, 3)
    assert (verdict.worst_program, verdict.worst_view, verdict.worst_rmse) == ("raycast", "superior", 0.006)
    assert verdict.share == pytest.approx(0.006 / 0.0055)


def test_a_level_that_is_worse_than_box_means_fails_also_if_it_is_for_previews(report: Report) -> None:
    verdict = with_others(report, level_drawing(1, seen(0.05, flip=0.09, kept=0.6), preview=True))
    assert (verdict.code, verdict.worse) == ("worse-than-box", ("level 1 with skin",))


def test_a_level_that_is_shifted_fails_also_if_it_is_for_previews(report: Report) -> None:
    verdict = with_others(report, level_drawing(1, seen(0.02, kept=0.8), preview=True, shift_voxels=0.5))
    assert (verdict.code, verdict.shifted) == ("shifted", ("level 1 with skin",))


def test_a_level_beyond_its_tolerance_fails_unless_the_box_reference_excuses_it(report: Report) -> None:
    numbers = seen(0.02, flip=0.05, kept=0.8)
    assert with_others(report, level_drawing(1, numbers)).code == "part-beyond"
    assert with_others(report, level_drawing(1, numbers, preview=True)).code == "part-beyond"
    assert with_others(report, level_drawing(1, numbers, preview=True, excused=True)).code == "within"
    assert with_others(report, level_drawing(1, numbers, preview=True, passed=True)).code == "within"


def test_levels_for_previews_are_judged_by_the_looser_of_both_tolerances() -> None:
    assert LIMITS.of_previews == Tolerance(rmse=0.035, maximum=1.0, flip=0.1, kept_light=0.5)
    loose = Tolerance(rmse=0.2, flip=0.3, kept_light=0.0, levels=LevelTolerance(rmse=0.1, flip=0.4, kept_light=0.6))
    found = loose.of_previews
    assert (found.rmse, found.flip, found.kept_light) == (0.2, 0.4, 0.0)


@pytest.mark.parametrize("numbers", [seen(0.04), seen(0.01, flip=0.14), seen(0.01, kept=0.3)])
def test_each_number_can_be_worse_than_that_of_box_means(numbers) -> None:
    box = seen(0.03, flip=0.1, kept=0.4)
    assert is_worse(level_view(numbers, box), seen(0.001, flip=0.005))
    assert not is_worse(level_view(box, box), seen(0.001, flip=0.005))
    assert not is_worse(level_view(numbers, box), seen(0.02, flip=0.05, kept=0.8))


def test_kept_light_is_compared_with_that_of_box_means_in_large_pictures() -> None:
    box, finest = seen(0.03, flip=0.1, kept=0.9), seen(0.001, flip=0.005)
    small = level_view(seen(0.03, flip=0.1, kept=0.3), box, full=in_full(box))
    assert not is_worse(small, finest)
    assert is_worse(small.model_copy(update={"full": in_full(small.seen)}), finest)


def test_what_8_bits_round_makes_no_level_worse() -> None:
    level = level_view(seen(0.0318, flip=0.109, kept=0.36), seen(0.03, flip=0.1, kept=0.4))
    assert not is_worse(level, seen(0.0, flip=0.0))


def test_a_level_keeps_less_than_box_means_only_if_it_does_for_certain() -> None:
    box, finest = seen(0.03, flip=0.1, kept=0.53, within=0.1), seen(0.0, flip=0.0)
    assert is_worse(level_view(seen(0.03, flip=0.1, kept=0.46), box), finest)
    assert not is_worse(level_view(seen(0.03, flip=0.1, kept=0.46, within=0.07), box), finest)
    assert is_worse(level_view(seen(0.03, flip=0.1, kept=0.2, within=0.07), box), finest)


def test_no_level_keeps_less_of_a_thing_that_box_means_have_lost() -> None:
    """Light below 0 is that of surroundings which have become brighter than a dark thing: it says how bright."""
    finest = seen(0.0, flip=0.0)
    assert not is_worse(level_view(seen(0.03, flip=0.1, kept=-1.8), seen(0.03, flip=0.1, kept=-0.75)), finest)
    assert not is_worse(level_view(seen(0.03, flip=0.1, kept=-1.8), seen(0.03, flip=0.1, kept=0.04)), finest)
    assert is_worse(level_view(seen(0.03, flip=0.1, kept=-1.8), seen(0.03, flip=0.1, kept=0.06)), finest)


def test_box_means_whose_light_is_not_certain_make_no_level_worse() -> None:
    level, finest = seen(0.03, flip=0.1, kept=0.59), seen(0.0, flip=0.0)
    assert not is_worse(level_view(level, seen(0.03, flip=0.1, kept=1.6, within=3.4)), finest)
    assert is_worse(level_view(level, seen(0.03, flip=0.1, kept=1.6, within=1.5)), finest)


def test_a_level_may_be_for_previews_only_if_box_means_are_beyond_the_tolerance() -> None:
    assert may_be_preview([seen(0.005), seen(0.02)], LIMITS)
    assert may_be_preview([seen(0.005, kept=0.5)], LIMITS)
    assert not may_be_preview([seen(0.005), seen(0.009, maximum=0.9)], LIMITS)
    assert may_be_preview([seen(0.005, flip=0.029)], LIMITS)  # a level may be worse by a twentieth
    assert not may_be_preview([seen(0.005, flip=0.028)], LIMITS)
    assert not may_be_preview([], LIMITS)
