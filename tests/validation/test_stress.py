"""The cases in which arithmetic is hard: drawn as they must be, and a renderer that errs is found out."""

import json
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from command_line import volprep
from sample_report import errors

from volprep.lab.stress.cases import CASES
from volprep.lab.stress.drawing import PRECISIONS, STEP_RATIOS, Trials
from volprep.lab.stress.records import StressDrawing, StressPoint, StressReport
from volprep.lab.stress.study import stress
from volprep.render.renderer import Renderer
from volprep.scene.profiles import load_profile
from volprep.techniques import TECHNIQUES
from volprep_cli.main import command_line
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.manifest import Tolerance
from volprep_formats.progress import Silent

CASE = {case.name: case for case in CASES}


@pytest.fixture(autouse=True)
def _small_pictures():
    # A patch of its own: where a test has the fixture monkeypatch, no stage is remembered, and no stage reads this.
    with patch("volprep.lab.stress.measure.PICTURE_SIZE", 32):
        yield


USUAL = Trials(techniques=("ray-casting",), precisions=("highp",), levels=False)
"""What scenes have that ask for nothing."""


def tried(folder: Path, *names: str, profile: str = "gles3", trials: Trials = USUAL) -> StressReport:
    chosen = [case for case in CASES if case.name in names]
    return stress(chosen, load_profile(profile, folder), folder / "stress.report", Silent(), trials)


def faults(report: StressReport) -> set[tuple[str, str]]:
    """What the report says is wrong: case, and how values become colours."""
    return {
        (result.case, each.classification) for result in report.results for each in result.drawings if not each.passed
    }


def test_cases_have_names_of_their_own_and_each_depth_follows_a_fainter_one():
    assert len(CASE) == len(CASES)
    depths = [case for case in CASES if case.fainter is not None]
    assert len(depths) == 9
    for case in depths:
        assert case.points[0].extinction_per_mm > CASE[case.fainter].points[0].extinction_per_mm


@pytest.mark.long
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_walls_depths_and_extreme_numbers_are_drawn_as_they_must_be(tmp_path, profile):
    report = tried(tmp_path, "depth-1e0", "depth-1e2", "wall", "huge", profile=profile)
    assert faults(report) == set()
    for result in report.results:
        assert [drawing.classification for drawing in result.drawings] == ["lookup", "preintegrated"]
        for drawing in result.drawings:
            assert (tmp_path / "stress.report" / drawing.picture).is_file()
            assert all(point.draw_ms > 0 for point in drawing.points)
    page = (tmp_path / "stress.report" / "index.html").read_text()
    assert all(case in page for case, _ in faults(report))
    assert StressReport.model_validate_json((tmp_path / "stress.report" / "report.json").read_bytes()) == report


def test_a_shell_thinner_than_the_samples_is_missed_by_them_and_seen_between_them(tmp_path):
    (result,) = tried(tmp_path, "thin-shells").results
    lookup, preintegrated = result.drawings
    assert lookup.limit is None
    assert lookup.passed
    assert preintegrated.total.rmse < lookup.total.rmse / 5


@pytest.mark.long
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_coarse_levels_show_shells_thinner_than_an_entry_of_their_own_tables(tmp_path, profile):
    """Light of entries is mixed, not colours, and what a shell hides lies between two entries."""
    report = tried(
        tmp_path, "thin-shells", "sixteen-bits", "jumps", profile=profile, trials=replace(USUAL, levels=True)
    )
    assert faults(report) == set()
    for result in report.results:
        coarse = [each for each in result.drawings if each.level and each.classification == "preintegrated"]
        assert len(coarse) == 2
        assert all(each.limit is not None for each in coarse)


@pytest.mark.long
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_each_technique_level_and_precision_is_drawn_and_judged(tmp_path, profile):
    report = tried(tmp_path, "depth-1e-1", profile=profile, trials=Trials())
    assert report.passed
    drawings = report.results[0].drawings
    sampling = "texture3d" if profile == "gles3" else "mosaic"
    assert {each.technique for each in drawings} == {name for name, t in TECHNIQUES.items() if sampling in t.samplings}
    assert {each.precision for each in drawings} == set(PRECISIONS)
    assert len({each.level for each in drawings}) == 3
    assert len({each.name for each in drawings}) == len(drawings)
    for each in drawings:
        judged = each.precision == "highp" and TECHNIQUES[each.technique].order is None
        assert (each.limit is not None) == judged
        assert (each.precise is not None) == (each.technique in {"slabs", "axis-slices", "view-slices"} and judged)
    layers = [each for each in drawings if each.technique == "view-slices"]
    # Four times as many layers are rounded as often again.
    assert all(each.points[-1].rmse > 2 * each.precise.rmse for each in layers)
    page = (tmp_path / "stress.report" / "index.html").read_text()
    assert "mediump-coordinates" in page
    assert all(sentence in page for sentence in report.not_judged)
    reported = {each.technique for each in drawings if each.limit is None and each.precision == "highp"}
    assert reported
    for name in (*reported, *(precision for precision in PRECISIONS if precision != "highp"), "palette", "maximum"):
        assert any(name in sentence for sentence in report.not_judged), name


def test_what_was_not_asked_for_and_what_samples_may_miss_is_said_to_be_unjudged(tmp_path):
    report = tried(tmp_path, "thin-shells")
    assert report.passed
    said = "\n".join(report.not_judged)
    assert "Errors of lookup in thin-shells: a feature is thinner than the distance of samples" in said
    assert "Coarse levels: they were not asked for." in said
    assert "view-slices" in next(each for each in report.not_judged if each.startswith("Techniques"))


def test_a_technique_that_errs_fails_where_ray_casting_does_not(tmp_path, monkeypatch):
    right = Renderer.render

    def render(self, *arguments):
        return right(self, *arguments) * np.float32(0.9 if self.program.technique == "two-pass" else 1.0)

    monkeypatch.setattr(Renderer, "render", render)
    trials = replace(USUAL, techniques=("ray-casting", "two-pass"))
    report = tried(tmp_path, "depth-1e1", trials=trials)
    assert not report.passed
    assert {each.technique for each in report.results[0].drawings if not each.passed} == {"two-pass"}


def test_no_case_is_begun_when_the_time_is_over(tmp_path):
    report = tried(tmp_path, "depth-1e0", "one-voxel", trials=replace(USUAL, seconds=0.0))
    assert report.results == ()
    assert report.left_out == ("depth-1e0", "one-voxel")


def test_cases_that_were_not_tried_are_not_passed_and_are_named(tmp_path, monkeypatch) -> None:
    words = [
        "study",
        "stress",
        "--case",
        "one-voxel",
        "--case",
        "negative",
        "--seconds",
        "0",
        "--report",
        str(tmp_path / "s"),
    ]
    with pytest.raises(VolprepError, match="VP6072 2 of 2 cases were not tried") as caught:
        command_line(words)(words, standalone_mode=False)
    assert caught.value.status == ExitStatus.TOLERANCE
    assert "one-voxel, negative" in str(caught.value)
    page = (tmp_path / "s" / "index.html").read_text(encoding="utf-8")
    assert "2 cases were not tried" in page
    assert "as they must be" not in page


@pytest.mark.parametrize(
    ("steps", "worse"),
    [((0.02, 0.01, 0.005, 0.005), ()), ((0.01, 0.02, 0.01, 0.02), (1.0, 0.25)), ((0.01, 0.0119, 0.0124, 0.0124), ())],
)
def test_a_finer_step_that_is_worse_by_more_than_rounding_fails_and_is_named(steps, worse) -> None:
    points = [
        StressPoint(step_ratio=ratio, rmse=rmse, draw_ms=1.0) for ratio, rmse in zip(STEP_RATIOS, steps, strict=True)
    ]
    drawing = StressDrawing(
        classification="lookup", total=errors(0.01), limit=Tolerance(rmse=0.05), laws=(), points=points, picture=None
    )
    assert drawing.worse_steps == worse
    assert drawing.passed == (not worse)
    assert [problem.split("×")[0] for problem in drawing.problems] == [f"step {ratio:g}" for ratio in worse]
    assert drawing.model_copy(update={"limit": Tolerance(rmse=0.008)}).steps_beyond


@pytest.mark.parametrize(
    ("steps", "beyond"), [((0.002, 0.0122, 0.0005, 0.0003), ()), ((0.1, 0.05, 0.026, 0.012), (0.5,))]
)
def test_where_planes_decide_the_limit_falls_with_the_step_and_no_step_is_compared(steps, beyond) -> None:
    points = [
        StressPoint(step_ratio=ratio, rmse=rmse, draw_ms=1.0) for ratio, rmse in zip(STEP_RATIOS, steps, strict=True)
    ]
    drawing = StressDrawing(
        classification="lookup",
        total=errors(0.01),
        limit=Tolerance(rmse=0.05, maximum=1.0),
        common_planes=True,
        laws=(),
        points=points,
        picture=None,
    )
    assert drawing.worse_steps == ()
    assert drawing.steps_beyond == beyond
    assert drawing.passed == (not beyond)


@pytest.mark.parametrize(
    ("steps", "beyond"), [((0.03, 0.03, 0.032, 0.032), ()), ((0.03, 0.03, 0.04, 0.05), (0.5, 0.25))]
)
def test_where_planes_decide_an_error_that_ray_casting_has_at_every_step_is_allowed(steps, beyond) -> None:
    """The wall with tables of bytes, whose entries are wider than the wall."""
    points, of_rays = (
        [StressPoint(step_ratio=ratio, rmse=rmse, draw_ms=1.0) for ratio, rmse in zip(STEP_RATIOS, each, strict=True)]
        for each in (steps, (0.0328, 0.0308, 0.0308, 0.0308))
    )
    drawing = StressDrawing(
        classification="lookup",
        total=errors(0.01),
        limit=Tolerance(rmse=0.05, maximum=1.0),
        common_planes=True,
        laws=(),
        points=points,
        of_rays=of_rays,
        picture=None,
    )
    assert drawing.steps_beyond == beyond


def test_a_scan_without_a_true_picture_must_be_refused(tmp_path):
    report = tried(tmp_path, "no-number", "infinity")
    assert [result.refused for result in report.results] == ["VP1090", "VP1090"]
    assert report.passed
    assert report.driver is None
    drawn = replace(CASE["one-voxel"], refused="VP1090")
    report = stress([drawn], load_profile("gles3", tmp_path), tmp_path / "stress.report", Silent(), USUAL)
    assert not report.passed
    accepted = replace(CASE["no-number"], refused=None)
    report = stress([accepted], load_profile("gles3", tmp_path), tmp_path / "stress.report", Silent(), USUAL)
    assert not report.passed


@pytest.mark.parametrize(
    ("wrong", "law"),
    [
        (lambda picture: picture * np.float32(1.1), "opacity goes from 0 to 1.1"),
        (lambda picture: np.where(picture > 0.5, np.float32(np.nan), picture), "a pixel is no finite number"),
        (lambda picture: picture * np.float32([1, 1, 1, 0.9]), "a colour is brighter than its opacity"),
    ],
)
def test_a_renderer_that_breaks_a_law_fails(tmp_path, monkeypatch, wrong, law):
    right = Renderer.render

    def render(self, *arguments):
        picture = right(self, *arguments)
        return wrong(picture) if self._target_format == "rgba32f" else picture

    monkeypatch.setattr(Renderer, "render", render)
    report = tried(tmp_path, "depth-1e2")
    assert not report.passed
    assert all(any(law in each for each in drawing.laws) for drawing in report.results[0].drawings)


@pytest.mark.long
def test_depths_must_rise_in_opacity(tmp_path, monkeypatch):
    right = Renderer.render
    pictures = iter(np.linspace(1.0, 0.5, 1000, dtype=np.float32))
    monkeypatch.setattr(Renderer, "render", lambda self, *arguments: right(self, *arguments) * next(pictures))
    report = tried(tmp_path, "depth-1e1", "depth-1e2")
    assert all("less opaque" in drawing.laws[0] for drawing in report.results[1].drawings)


@pytest.mark.long
def test_the_command_says_which_case_is_beyond_its_limit(tmp_path, monkeypatch, capsys):
    words = [
        "study",
        "stress",
        "--case",
        "one-voxel",
        "--technique",
        "ray-casting",
        "--precision",
        "highp",
        "--report",
        str(tmp_path / "report"),
    ]
    done = volprep(*words, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["passed"] is True
    right = Renderer.render
    monkeypatch.setattr(Renderer, "render", lambda self, *arguments: right(self, *arguments) * np.float32(0.9))
    with pytest.raises(
        VolprepError, match=r"VP6018 1 of 1 cases .* the first is one-voxel: lookup: RMSE over seen pixels"
    ) as failed:
        command_line(words)(words, standalone_mode=False)
    assert failed.value.status == ExitStatus.TOLERANCE
    assert "beyond" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["--case", "no-such-case"], 2, "one-voxel"),
        (["--technique", "none"], 2, "view-slices"),
        (["--precision", "lowp"], 2, "mediump"),
        (["--profile", "gles1"], ExitStatus.SCENE, "VP6017 profile gles1 has no shaders"),
    ],
)
def test_what_cannot_be_tried_is_said(tmp_path, words, status, text):
    done = volprep("study", "stress", *words, "--report", tmp_path / "report")
    assert done.returncode == status
    assert text in done.stderr
    assert not (tmp_path / "report").exists()
