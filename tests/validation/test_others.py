"""Coarse levels and pieces of level 0: drawn, judged, and named when nothing has drawn them."""

from types import SimpleNamespace

import numpy as np
import pytest
import scene_builds
from judged import validate
from phantom_scene import write_phantom_scene
from sample_report import seen
from tamper_scenes import write_kind
from tampering import built

from volprep.parts.levels import preview
from volprep.report.page import page
from volprep.validation.comparison import coarse_levels as others
from volprep.validation.comparison.coarse_levels import unproved
from volprep.validation.comparison.pixels import Picture
from volprep.validation.folder import ReportFolder
from volprep.validation.results.report import Report
from volprep.validation.results.seen import OtherView
from volprep.validation.run import measure_package
from volprep.validation.timing.clock import Clock
from volprep_formats.package.manifest import Tolerance
from volprep_formats.progress import Silent

SIZE = 32


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> Report:
    """A scene of three levels, a mesh for each, light, and pieces of 8 voxels."""
    folder = tmp_path_factory.mktemp("house")
    scene = write_kind(folder, "house")
    return validate(built(folder, scene), folder / "report", picture_size=SIZE)


@pytest.mark.long
def test_each_coarse_level_is_drawn_in_nine_views_by_each_program_that_can(report) -> None:
    (program,) = report.programs
    levels = [(other.item, other.program) for other in program.others if other.item.startswith("level")]
    names = ("proxy-raycast-shell", "raycast-shell")
    assert levels == [(f"level {index} with shell", name) for index in (1, 2) for name in names]
    assert all(len(other.views) == 9 for other in program.others)


def test_a_voxel_of_a_level_is_a_pixel_which_is_the_mean_of_four_rays_at_least(report) -> None:
    """The diagonal is 25.2 mm, and the shortest edge of a voxel of level 2 is 3 mm; level 1 would have 17 pixels."""
    pixels = {other.item: other.pixels for other in report.programs[0].others}
    assert pixels["level 1 with shell"] == 16
    assert pixels["level 2 with shell"] == 8


def test_pieces_are_lit_by_slopes_and_judged_by_the_truth_lit_so(report) -> None:
    """Pieces hold a layer beyond each face between two blocks.

    With one-sided slopes there the worst view had up to 0.0055 and 0.14, with central ones of values that end half a
    voxel further on 0.0064 and 0.163.
    """
    pieces = [other for other in report.programs[0].others if other.program == "subvolumes-shell"]
    names = [
        f"pieces around points {first}, {first + 2}, ... with shell, lit by central differences" for first in (1, 0)
    ]
    assert [other.item for other in pieces] == names
    for other in pieces:
        assert max(view.rmse for view in other.views) < 0.0015
        assert max(view.seen.maximum for view in other.views) < 0.03


@pytest.mark.long
def test_pieces_of_a_scene_with_a_placed_light_are_lit_by_it(tmp_path) -> None:
    scene = write_kind(tmp_path, "house")
    text = scene.read_text(encoding="utf-8").replace('"headlight"', '"phong"')
    light = 'crop = "none"\nlighting = { light_mm = [20.0, -30.0, 40.0], normals = "forward" }'
    scene.write_text(text.replace('crop = "none"', light), encoding="utf-8")
    package = built(tmp_path, scene)
    report = validate(package, tmp_path / "report", picture_size=SIZE)
    pieces = [other for other in report.programs[0].others if other.program == "subvolumes-shell"]
    assert len(pieces) == 2
    assert not any("," in other.item.split(" with ")[1] for other in pieces)
    assert all(view.rmse < 0.01 for other in pieces for view in other.views)


def test_a_level_for_previews_has_a_tolerance_of_its_own_beyond_which_box_means_excuse_it(report) -> None:
    """Five voxels along the longest axis are too few for both tolerances of this scene."""
    verdict = report.verdict
    assert [(each.item, each.within) for each in verdict.levels if each.preview_only] == [
        ("level 1 with shell", True),
        ("level 2 with shell", False),
    ]
    told = {each.item: each.rmse for each in verdict.levels}
    assert told["level 2 with shell"] > told["level 1 with shell"] > report.tolerance.rmse
    assert verdict.beyond == ()
    assert verdict.passed


def test_without_an_excuse_box_means_are_drawn_in_the_view_in_which_a_level_is_furthest_beyond(monkeypatch) -> None:
    asked: list[str] = []

    def reference_view(*given: object) -> Picture:
        asked.append(str(given[-1]))
        return np.zeros((4, 4, 4), np.float32)

    def found(**rmse: float) -> list[OtherView]:
        return [OtherView(view=name, passed=each <= 0.035, rmse=each, seen=seen(each)) for name, each in rmse.items()]

    monkeypatch.setattr(others, "reference_view", reference_view)
    monkeypatch.setattr(others, "_boxes", lambda *given: given[-1])
    subject = SimpleNamespace(render=SimpleNamespace(tolerance=Tolerance()))
    bench = SimpleNamespace(subject=subject, clock=Clock())
    chosen = SimpleNamespace(level=1, program=SimpleNamespace(transfer="skin"))
    drawn = others._box_in_worst_view(bench, None, chosen, found(superior=0.05, inferior=0.06, left=0.01))
    assert ([*drawn], asked) == (["inferior"], ["inferior"])
    # In this view the reference is known, and is within.
    views = found(**{"anterior-left": 0.05, "left": 0.04})
    assert others._box_in_worst_view(bench, None, chosen, views) == {}
    assert others._box_in_worst_view(bench, None, chosen, found(left=0.01)) == {}


@pytest.mark.long
def test_a_level_that_is_not_for_previews_is_named_beyond_the_tolerance_and_fails_the_package(
    tmp_path, monkeypatch
) -> None:
    """As if the build had found levels to be good enough, both when it ran and when validation derives them."""
    monkeypatch.setattr(preview, "_allowed", lambda _: 1e6)
    report = validate(built(tmp_path, write_kind(tmp_path, "house")), tmp_path / "report", picture_size=SIZE)
    assert set(report.verdict.beyond) == {"level 1 with shell", "level 2 with shell"}
    assert not any(each.preview_only for each in report.verdict.levels)
    assert not report.verdict.passed


@pytest.mark.long
@pytest.mark.usefixtures("stages_run_again")
def test_the_mark_that_excuses_a_level_follows_from_the_scan_and_not_from_the_package(tmp_path, monkeypatch) -> None:
    """A package from a build that marked everything; validation, with the rule as it is, excuses what it finds."""
    text = write_kind(tmp_path, "house")
    loose = text.read_text(encoding="utf-8").replace("rmse = 0.02\nflip = 0.2", "rmse = 0.5\nflip = 1.0")
    text.write_text(loose, encoding="utf-8")
    monkeypatch.setattr(preview, "_allowed", lambda _: 0.0)
    package = built(tmp_path, text)
    monkeypatch.undo()
    verdict = validate(package, tmp_path / "report", picture_size=SIZE).verdict
    assert not any(each.preview_only for each in verdict.levels)
    assert verdict.differing == ("manifest.json",)


def test_everything_that_ships_was_drawn(report) -> None:
    assert report.verdict.unproved == ()


def test_a_program_that_nothing_has_drawn_is_named(report) -> None:
    fewer = tuple(
        program.model_copy(update={"others": tuple(each for each in program.others if "pieces" not in each.item)})
        for program in report.programs
    )
    assert unproved(report.package.manifest, fewer) == ("program subvolumes-shell at level 0",)


def test_the_page_lists_them(report) -> None:
    text = page(report)
    assert "level 2 with shell" in text
    assert "for previews, beyond, as the reference" in text
    assert "pieces around points 1, 3, ... with shell" in text


@pytest.mark.long
def test_pieces_of_a_projection_are_compared_one_by_one_because_pictures_of_it_do_not_add_up(
    tmp_path, monkeypatch
) -> None:
    scene = write_phantom_scene(tmp_path)
    text = scene.read_text(encoding="utf-8")
    # One transfer function, and blocks behind each other in every view.
    text = text[: text.rindex("[[transfer]]")]
    scene.write_text(
        text + '[render]\ncompositing = "maximum"\npicture_size = 24\n[grid]\nsize = 10\n', encoding="utf-8"
    )
    scene_builds.built(scene, tmp_path / "phantom.volpkg")
    found = {}
    for name in ("apart", "laid over"):
        if name == "laid over":
            monkeypatch.setattr(others, "PUT_TOGETHER", frozenset(("maximum",)))
        for folder in ("report/pictures", "scratch"):
            (tmp_path / name / folder).mkdir(parents=True)
        report = measure_package(
            tmp_path / "phantom.volpkg", ReportFolder(tmp_path / name / "report"), tmp_path / name / "scratch", Silent()
        )
        found[name] = [each for each in report.programs[0].others if each.item.startswith("pieces")]
    assert [len(each.views) for each in found["apart"]] == [3, 3]
    worst = {name: max(view.rmse for each in pieces for view in each.views) for name, pieces in found.items()}
    assert worst["apart"] < 0.01
    assert worst["laid over"] > 5 * worst["apart"]
