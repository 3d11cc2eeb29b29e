"""The cases in which arithmetic is hard: drawn as they must be, and a renderer that errs is found out."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import volprep

from volprep.render.renderer import Renderer
from volprep.report.stress import stress
from volprep.scene.profiles import load_profile
from volprep.techniques import TECHNIQUES
from volprep.validation.stress_cases import CASES
from volprep.validation.stress_drawing import PRECISIONS, Trials
from volprep.validation.stress_records import StressReport
from volprep_cli.main import command_line
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.progress import Silent

CASE = {case.name: case for case in CASES}


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch):
    monkeypatch.setattr("volprep.validation.stress.PICTURE_SIZE", 32)


USUAL = Trials(techniques=("ray-casting",), precisions=("highp",), levels=False)
"""What scenes have that ask for nothing."""


def tried(folder: Path, *names: str, profile: str = "gles3", trials: Trials = USUAL) -> StressReport:
    chosen = [case for case in CASES if case.name in names]
    return stress(chosen, load_profile(profile, folder), folder / "stress.report", Silent(), trials)


def test_cases_have_names_of_their_own_and_each_depth_follows_a_fainter_one():
    assert len(CASE) == len(CASES)
    depths = [case for case in CASES if case.fainter is not None]
    assert len(depths) == 9
    for case in depths:
        assert case.points[0].extinction_per_mm > CASE[case.fainter].points[0].extinction_per_mm


@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_walls_depths_and_extreme_numbers_are_drawn_as_they_must_be(tmp_path, profile):
    report = tried(tmp_path, "depth-1e0", "depth-1e2", "wall", "huge", profile=profile)
    assert report.passed
    for result in report.results:
        assert [drawing.classification for drawing in result.drawings] == ["lookup", "preintegrated"]
        for drawing in result.drawings:
            assert (tmp_path / "stress.report" / drawing.picture).is_file()
            assert all(point.draw_ms > 0 for point in drawing.points)
    page = (tmp_path / "stress.report" / "index.html").read_text()
    assert "All 4 cases" in page
    assert StressReport.model_validate_json((tmp_path / "stress.report" / "report.json").read_bytes()) == report


def test_a_shell_thinner_than_the_samples_is_missed_by_them_and_seen_between_them(tmp_path):
    (result,) = tried(tmp_path, "thin-shells").results
    lookup, preintegrated = result.drawings
    assert lookup.limit is None
    assert lookup.passed
    assert preintegrated.passed
    assert preintegrated.total.rmse < lookup.total.rmse / 5


@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_coarse_levels_show_shells_thinner_than_an_entry_of_their_own_tables(tmp_path, profile):
    """Light of entries is mixed, not colours, and what a shell hides lies between two entries."""
    report = tried(
        tmp_path, "thin-shells", "sixteen-bits", "jumps", profile=profile, trials=replace(USUAL, levels=True)
    )
    assert report.passed
    for result in report.results:
        coarse = [each for each in result.drawings if each.level and each.classification == "preintegrated"]
        assert len(coarse) == 2
        assert all(each.limit is not None for each in coarse)


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
    assert "mediump-coordinates" in (tmp_path / "stress.report" / "index.html").read_text()


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


def test_depths_must_rise_in_opacity(tmp_path, monkeypatch):
    right = Renderer.render
    pictures = iter(np.linspace(1.0, 0.5, 1000, dtype=np.float32))
    monkeypatch.setattr(Renderer, "render", lambda self, *arguments: right(self, *arguments) * next(pictures))
    report = tried(tmp_path, "depth-1e1", "depth-1e2")
    assert all("less opaque" in drawing.laws[0] for drawing in report.results[1].drawings)


def test_the_command_says_which_case_is_beyond_its_limit(tmp_path, monkeypatch, capsys):
    words = [
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
    with pytest.raises(VolprepError, match=r"VP6018 1 of 1 cases .* the first is one-voxel: lookup: RMSE") as failed:
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
    done = volprep("stress", *words, "--report", tmp_path / "report")
    assert done.returncode == status
    assert text in done.stderr
    assert not (tmp_path / "report").exists()
