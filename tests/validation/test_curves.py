"""Curves of choices: variants are built, drawn, timed and compared; the page shows them with what the package has."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_scene import write_phantom_scene
from scene_builds import built

from volprep.lab import small_scan
from volprep.lab.curves import measure
from volprep.lab.curves.choices import CHOICES, Choice, Variant
from volprep.lab.curves.front import beats, with_front
from volprep.lab.curves.measure import measure_curves
from volprep.lab.curves.page import curves_page
from volprep.lab.curves.records import CurveErrors, CurvePoint, CurvesReport, Milliseconds, plotted_cost
from volprep.lab.studies import CURVES
from volprep.lab.variants import with_changes
from volprep.render.timing import draws_with_processor
from volprep.report.validate import validate
from volprep.scene.scene import Scene
from volprep.validation.subjects.scan import find_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

pytestmark = pytest.mark.long

LOOSE = "[tolerance]\nrmse = 0.03\nmaximum = 1.0\nflip = 0.3\nkept_light = 0.0\n"
"""Codes of 8 bits and short tables are enough for it."""
NAMED = {choice.name: choice for choice in CHOICES}
FEW = (
    *("step and level", "bits of a voxel", "early ray termination", "normals", "where normals come from"),
    *("tables of levels", "proxy geometry"),
)
CUT = {"early ray termination": slice(7, 9), "proxy geometry": slice(0, 2), "tables of levels": slice(0, 2)}
"""Of some choices only these variants: each is a build."""


SCENE = {
    "name": "s",
    "source": {"path": "x"},
    "transfer": [{"name": "t", "points": [{"value": 0, "colour": "#ffffff", "extinction_per_mm": 0.1}]}],
}


def few_choices():
    for name in FEW:
        choice, kept = NAMED[name], CUT.get(name, slice(None))
        yield replace(choice, variants=lambda scene, choice=choice, kept=kept: choice.variants(scene)[kept])


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return built(write_phantom_scene(tmp_path_factory.mktemp("curves"), more=LOOSE)).path


@pytest.fixture(scope="module")
def report(package, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measure, "CHOICES", tuple(few_choices()))
        patch.setattr(measure, "_TURNS", 3)
        folder = tmp_path_factory.mktemp("scratch")
        return measure_curves(Package.open(package).manifest, find_scan(package, None), folder, Silent(), 48)


def curve(report, name):
    return next(each for each in report.curves if each.name == name)


def test_every_choice_has_a_curve_or_says_why_not(report) -> None:
    assert [each.name for each in report.curves] == list(FEW)
    for each in report.curves:
        assert bool(each.points) == (each.left_out is None)
    assert curve(report, "normals").left_out == "the scene has no lighting"


def test_the_variant_that_the_package_has_is_marked_once(report) -> None:
    for each in report.curves:
        assert sum(point.chosen for point in each.points) == (1 if each.points else 0), each.name
    assert next(point.label for point in curve(report, "tables of levels").points if point.chosen).startswith(
        "lookup, own"
    )
    (chosen,) = (point for point in curve(report, "early ray termination").points if point.chosen)
    assert chosen.label == "rays run to their end"
    assert "rays may end at 0.998" in curve(report, "early ray termination").reason


def test_steps_and_levels_are_drawn_and_coarser_levels_are_worse(report) -> None:
    points = curve(report, "step and level").points
    finest = [point for point in points if point.series == "level 0"]
    errors = [point.errors.rmse for point in finest]
    assert [round(point.step_mm / finest[-1].step_mm, 6) for point in finest] == [16, 8, 4, 2, 1]
    assert max(errors) < min(point.errors.rmse for point in points if point.level == 2)
    assert {point.level for point in points} == {0, 1, 2}


def test_more_bits_take_more_bytes(report) -> None:
    eight, sixteen = curve(report, "bits of a voxel").points
    assert (eight.label, sixteen.label) == ("8 bits", "16 bits")
    assert sixteen.upload_bytes > eight.upload_bytes
    assert sixteen.errors.rmse <= eight.errors.rmse * 1.01


def test_times_have_a_spread_and_a_number_of_pictures(report) -> None:
    for point in (point for each in report.curves for point in each.points):
        for times in filter(None, (point.wall, point.gpu)):
            assert 0 <= times.low <= times.median <= times.high
        assert point.wall.pictures == 3
        # Others would draw all again for the same times.
        assert point.gpu is None or not draws_with_processor(report.driver.renderer)


def test_a_level_is_drawn_with_its_own_table_and_with_the_common_one(report) -> None:
    points = curve(report, "tables of levels").points
    assert {point.label for point in points} == {
        f"lookup, {name} table, level 1, {step}× step" for name in ("own", "common") for step in (1, 2)
    }
    assert len({point.errors.rmse for point in points}) == 4


def test_gradients_in_the_shader_are_a_choice_of_lit_scenes() -> None:
    names = NAMED["where normals come from"]
    unlit = Scene.model_validate(SCENE)
    lit = Scene.model_validate(SCENE | {"render": {"lighting": "headlight"}})
    assert names.variants(unlit) == []
    assert [each.wanted for each in names.variants(lit)] == ["volume", "forward", "central"]
    for variant in names.variants(lit):
        assert with_changes(lit, variant.changes).lighting.normals == variant.wanted


def test_what_the_plan_does_not_make_is_told(report) -> None:
    found = curve(report, "proxy geometry")
    made = {point.label for point in found.points}
    told = {each.label for each in found.refused}
    assert made | told == {"none", "blocks"}


def test_the_page_shows_every_curve_and_the_data_come_back_as_they_were(report) -> None:
    page = curves_page(report)
    for each in report.curves:
        assert f'id="{each.name.replace(" ", "-")}"' in page
    assert page.count("<svg viewBox") == 2 * sum(bool(each.points) for each in report.curves)
    assert "in the package" in page
    assert "Nothing to measure: the scene has no lighting." in page
    assert CurvesReport.model_validate_json(report.model_dump_json()) == report


def test_a_new_choice_is_one_more_entry(package, tmp_path, monkeypatch) -> None:
    gutter = Choice(
        "projection",
        "Does the projection matter?",
        "bytes",
        lambda _: [Variant("orthographic", {"render": {"projection": "orthographic"}})],
        lambda manifest: manifest.render.projection,
        lambda _: "preview",
    )
    monkeypatch.setattr(measure, "CHOICES", (gutter,))
    monkeypatch.setattr(measure, "_TURNS", 3)
    found = measure_curves(Package.open(package).manifest, find_scan(package, None), tmp_path, Silent(), 32)
    assert [point.label for point in found.curves[0].points] == ["orthographic"]
    assert "Does the projection matter?" in curves_page(found)


def test_a_run_that_is_stopped_has_the_choices_before(package, tmp_path, monkeypatch) -> None:
    calls = []

    def variants(_scene):
        # Asked once for the count of variants, and stopped when it is measured.
        calls.append("asked")
        if len(calls) > 1:
            raise KeyboardInterrupt
        return []

    stopped = replace(NAMED["step and level"], variants=variants)
    monkeypatch.setattr(measure, "_TURNS", 3)
    monkeypatch.setattr(measure, "CHOICES", (NAMED["bits of a voxel"], stopped))

    found = measure_curves(Package.open(package).manifest, find_scan(package, None), tmp_path, Silent(), 32)

    assert [bool(each.points) for each in found.curves] == [True, False]
    assert found.is_stopped
    assert "stopped" in curves_page(found)


def test_validate_writes_curves_into_the_report_and_over_an_older_one(package, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(measure, "CHOICES", (NAMED["bits of a voxel"],))
    monkeypatch.setattr(measure, "_TURNS", 3)
    monkeypatch.setattr("volprep.report.validate.measure_package", lambda *_, **__: stub(package))
    monkeypatch.setattr("volprep.report.validate.page", lambda _, studies: ", ".join(study.name for study in studies))
    target = tmp_path / "phantom.report"
    for _ in range(2):
        validate(package, target, Silent(), picture_size=32, studies=[CURVES])
    assert sorted(path.name for path in target.iterdir()) == ["index.html", "pictures", "report.json", "studies"]
    assert sorted(path.name for path in (target / "studies").iterdir()) == ["curves.html", "curves.json"]
    assert (target / "index.html").read_text() == "curves"
    assert not (tmp_path / ".phantom.report.scratch").exists()


def stub(package):
    """A report of which only the manifest is read."""
    from volprep.validation.results.report import PackageFacts, Report

    facts = PackageFacts.model_construct(manifest=Package.open(package).manifest)
    return Report.model_construct(package=facts)


def test_curves_of_a_package_without_shaders_are_refused(package, tmp_path) -> None:
    manifest = Package.open(package).manifest
    profile = manifest.profile.model_copy(update={"name": "old", "api": "es1.1"})
    with pytest.raises(VolprepError, match="VP6050 curves need shaders, and profile old has none"):
        measure_curves(
            manifest.model_copy(update={"profile": profile, "programs": ()}),
            find_scan(package, None),
            tmp_path,
            Silent(),
            32,
        )


def test_a_large_scan_becomes_means_that_fill_the_same_place(package, tmp_path, monkeypatch) -> None:
    spec = find_scan(package, None).spec_of("")
    whole, factor = small_scan.write_scan(spec, tmp_path / "whole.nrrd", Silent())
    assert factor == 1
    monkeypatch.setattr(small_scan, "MOST_VOXELS", 21 * 34 * 45 // 5)
    means, factor = small_scan.write_scan(spec, tmp_path / "means.nrrd", Silent())
    assert factor == 2
    fine, coarse = small_scan.read_scan(whole, None), small_scan.read_scan(means, None)
    assert coarse.grid.shape_zyx == (11, 17, 23)
    np.testing.assert_allclose(coarse.grid.origin_mm_xyz, fine.grid.coarser((2, 2, 2)).origin_mm_xyz, atol=1e-9)
    expected = fine.stored[:2, :2, :2].astype(float).mean()
    assert coarse.stored[0, 0, 0] == pytest.approx(expected, abs=0.51)


def point(label: str, milliseconds: float, rmse: float) -> CurvePoint:
    errors = CurveErrors(rmse=rmse, maximum=rmse, ssim_black=1.0, ssim_white=1.0, flip_black=0.0, flip_white=0.0)
    times = Milliseconds(median=milliseconds, low=milliseconds, high=milliseconds, pictures=1)
    return CurvePoint(
        label=label,
        series=label,
        level=0,
        step_mm=1.0,
        errors=errors,
        wall=times,
        gpu=None,
        upload_bytes=1,
        package_bytes=1,
        build_seconds=1.0,
        chosen=False,
        on_front=False,
    )


def test_the_front_is_what_nothing_beats_in_both() -> None:
    points = [point("a", 1, 0.3), point("b", 2, 0.1), point("c", 2, 0.2), point("d", 3, 0.1), point("e", 4, 0.05)]
    marked = with_front(points, "milliseconds")
    assert [each.label for each in marked if each.on_front] == ["a", "b", "e"]
    same = with_front([replace_label(points[0], "x"), points[0]], "milliseconds")
    assert all(each.on_front for each in same)
    assert plotted_cost(points[1], "milliseconds") == 2


def test_an_error_that_is_hardly_smaller_beats_no_faster_draw() -> None:
    """A draw of 51.7 ms is beaten by one of 30.6 ms that is 0.007 % worse."""
    slow, fast = point("slow", 51.7, 0.01), point("fast", 30.6, 0.0100007)
    assert [each.on_front for each in with_front([slow, fast], "milliseconds")] == [False, True]


def test_what_beats_a_point_beats_all_that_this_point_beats() -> None:
    rng = np.random.default_rng(8)
    points = [point(str(k), *rng.uniform(1.0, 1.4, 2)) for k in range(60)]
    better = np.array([[beats(one, other, "milliseconds") for other in points] for one in points])
    assert better.any()
    assert not (better & better.T).any()
    assert not ((better.astype(int) @ better.astype(int) > 0) & ~better).any()


def test_a_draw_that_takes_longer_beats_no_faster_one_however_its_times_scatter() -> None:
    """The times of a busy machine: only the slowest of these was on the front."""
    points = [point("1×", 80, 0.0019), point("1⁄2×", 150, 0.0012), point("1⁄8×", 354, 0.00103)]
    busy = [
        each.model_copy(update={"wall": each.wall.model_copy(update={"low": 30.0, "high": 600.0})}) for each in points
    ]
    assert all(each.on_front for each in with_front(busy, "milliseconds"))


def replace_label(one: CurvePoint, label: str) -> CurvePoint:
    return one.model_copy(update={"label": label})
