"""The last lines of a verdict."""

import pytest

from tests.support.sample_report import VIEWS, level_drawing, report_of, seen
from volprep.report.verdict_words import unsound_levels, verdict_lines
from volprep.validation.results.seen import KeptStyle, LostThings
from volprep.validation.verdicts.outcomes import (
    FinestOutcome,
    LevelOutcome,
    LostContrast,
    LostStructures,
    level_outcomes,
)
from volprep.validation.verdicts.verdict import Verdict, judge
from volprep_cli.main import command_line
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.manifest import Tolerance

FINEST = FinestOutcome(level=0, transfer="skin", views=9, beyond=0)
VESSEL = LostStructures(thin=1, small=0, kept_light=0.03, view="anterior")


def outcome(level: int = 1, **changed: object) -> LevelOutcome:
    fields = {"rmse": 0.02, "within": True, "preview_only": True, "right_up_to_pixels": 60, **changed}
    return LevelOutcome(item=f"level {level} with skin", level=level, transfer="skin", **fields)


def told(*levels: LevelOutcome, **changed: object) -> list[str]:
    return verdict_lines(Verdict.model_construct(finest=(FINEST,), levels=levels, unwitnessed=(), **changed))


@pytest.mark.parametrize(
    ("lost", "words"),
    [
        ({}, "level 1 within"),
        ({"within": False}, "level 1 beyond"),
        ({"structures": VESSEL}, "level 1 loses 1 thin structure (0.03 of its light, seen from the front)"),
        (
            {"structures": LostStructures(thin=2, small=1, kept_light=-0.2, view="superior")},
            "level 1 loses 2 thin structures and 1 small thing (none of the light of one is left, seen from above)",
        ),
        (
            {"contrast": LostContrast(loss=0.36, view="left")},
            "level 1 loses up to 0.36 of local contrast (seen from the patient's left)",
        ),
        (
            {"segments": ("a", "b"), "visible_segments": 7, "parts": ("liver (1 of 2 parts)",)},
            "level 1 loses 2 of 7 segments (a, b) and parts of liver (1 of 2 parts)",
        ),
    ],
)
def test_the_last_lines_name_what_a_level_has_lost(lost, words) -> None:
    level = outcome(**lost)
    assert told(level)[0] == f"level 0 within; {words}; usable to 60 pixels"
    assert unsound_levels(Verdict.model_construct(levels=(level,))) == (f"{words}; usable to 60 pixels" if lost else "")


@pytest.mark.parametrize(
    ("bound", "rmse", "words"),
    [
        (0.0, 0.009, "level 0 from bricks within"),
        (0.03, 0.009, "level 0 from bricks within, 0.03 stated for bricks that the device has no room for"),
        # The statement holds, and the picture is beyond the tolerance of the scene.
        (
            0.03,
            0.02,
            "level 0 from bricks beyond in 1 of 1 views, 0.03 stated for bricks that the device has no room for",
        ),
    ],
)
def test_a_picture_from_bricks_is_judged_in_place_of_the_level_that_is_held_whole(bound, rmse, words) -> None:
    report = report_of((0.5,) * len(VIEWS))
    numbers = seen(rmse, flip=0.02, kept=0.9)
    held, fewer = (
        level_drawing(0, numbers, passed=True).model_copy(update={"bound": stated, "sizes": (), "item": "bricks"})
        for stated in (bound, 0.4)
    )
    program = report.programs[0].model_copy(update={"level": 1, "others": (held, fewer), "empty_space": None})
    verdict = judge([program], Tolerance())
    assert verdict_lines(verdict)[0] == words
    assert verdict.code == ("within" if rmse < 0.01 else "part-beyond")
    assert verdict.failed == 0
    assert verdict.worst_rmse == rmse
    assert verdict.worst_data_rmse is None
    # A level 0 that the package holds whole is the one that counts.
    assert judge([program.model_copy(update={"level": 0})], Tolerance()).code == "beyond"


def test_a_level_that_is_right_at_no_size_and_views_beyond_are_told() -> None:
    verdict = Verdict.model_construct(
        finest=(FINEST.model_copy(update={"beyond": 2}),), levels=(outcome(right_up_to_pixels=None),), unwitnessed=()
    )
    assert verdict_lines(verdict)[0] == "level 0 beyond in 2 of 9 views; level 1 within; right at no measured size"


def test_pictures_of_several_functions_are_named() -> None:
    bone = FINEST.model_copy(update={"transfer": "bone"})
    verdict = Verdict.model_construct(finest=(FINEST, bone), levels=(outcome(),), unwitnessed=())
    assert verdict_lines(verdict)[:2] == [
        "skin: level 0 within; level 1 within; usable to 60 pixels",
        "bone: level 0 within",
    ]


@pytest.mark.parametrize(
    ("unwitnessed", "words"),
    [
        (None, "no witness was asked: `volprep validate --witness` lets VTK and independent readers judge"),
        ((), "all of it was witnessed"),
        (("raycast (it is lit)",), "not witnessed: raycast (it is lit)"),
    ],
)
def test_what_nobody_witnessed_is_in_the_last_line(unwitnessed, words) -> None:
    verdict = Verdict.model_construct(finest=(FINEST,), levels=(), unwitnessed=unwitnessed)
    assert verdict_lines(verdict)[-1] == words


def test_what_a_level_has_lost_comes_from_its_worst_view_and_its_segments() -> None:
    drawing = level_drawing(1, seen(0.01), preview=True, passed=True)
    (view,) = drawing.views
    lost = LostThings(thin=1, small=2, kept_light=0.1)
    full = view.full.model_copy(update={"lost": lost, "contrast_loss": 0.3})
    style = KeptStyle(
        transfer="skin",
        kept_light=1.0,
        segments=3,
        least="dot",
        least_kept_light=0.0,
        too_small=("dot",),
        lost_parts=("rib (1 of 24 parts)",),
    )
    worst = view.model_copy(update={"view": "superior", "full": full})
    changed = drawing.model_copy(update={"views": (view, worst), "styles": (style,)})
    program = report_of((0.001, 0.001, 0.001)).programs[0].model_copy(update={"others": (changed,)})
    (found,) = level_outcomes([program], Tolerance())
    assert found.structures == LostStructures(thin=1, small=2, kept_light=0.1, view="superior")
    assert found.contrast == LostContrast(loss=0.3, view="superior")
    assert (found.segments, found.visible_segments, found.parts) == (("dot",), 3, ("rib (1 of 24 parts)",))
    assert not found.is_sound
    assert found.within


def test_a_level_stands_beside_box_means_in_the_same_views() -> None:
    """The worst of nine views of the level stood beside the worst of three of the means."""
    drawing = level_drawing(1, seen(0.01), preview=True, passed=True)
    (view,) = drawing.views
    both = view.model_copy(update={"seen": seen(0.02), "box": seen(0.03)})
    without = view.model_copy(update={"view": "superior", "seen": seen(0.9), "box": None})
    found = drawing.model_copy(update={"views": (both, without)})
    assert [(each.rmse, box.rmse) for each, box in zip(found.beside_boxes, found.boxes, strict=True)] == [(0.02, 0.03)]


def test_strict_levels_fails_on_what_a_level_for_previews_has_lost(monkeypatch, capsys) -> None:
    report = report_of((0.001, 0.001, 0.001))

    def strictly_judged(level: LevelOutcome) -> None:
        verdict = report.verdict.model_copy(update={"code": "within", "levels": (level,)})
        judged = report.model_copy(update={"verdict": verdict})
        monkeypatch.setattr("volprep.report.validate.validate", lambda *_, **__: judged)
        command_line(["validate"])(["validate", "skin.volpkg", "--strict-levels"], standalone_mode=False)

    strictly_judged(outcome())
    with pytest.raises(VolprepError, match=r"VP6085 .*level 1 loses 1 thin structure") as caught:
        strictly_judged(outcome(structures=VESSEL))
    assert caught.value.status is ExitStatus.TOLERANCE
    assert "level 1 loses 1 thin structure" in capsys.readouterr().out
