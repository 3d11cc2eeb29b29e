"""VTK as a second witness: it agrees with what is right, and not with what is wrong by half a voxel."""

import importlib.util
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import tiny_packages
from judged import validate
from tamper_scenes import write_kind
from tampering import built

from volprep.compositing import COMPOSITINGS
from volprep.report.page import page
from volprep.scene.presets import load_preset
from volprep.truth.camera import standard_views
from volprep.truth.volume import Medium, Volume
from volprep.validation.comparison.views import Statement
from volprep.validation.results.report import Report
from volprep.validation.verdicts.errors import error_of_verdict
from volprep.validation.verdicts.verdict import judge
from volprep.validation.witness import second_reading
from volprep.validation.witness.independent.scan import CannotWitnessError
from volprep.validation.witness.independent.scene import read_scene
from volprep.validation.witness.judge import ask_witness, compared
from volprep.validation.witness.records import WitnessView
from volprep.validation.witness.vtk_views import MOST_VOXELS, draw_views
from volprep.vtk.process import run_script
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid

SIZE = 48
TOLERANCE = 0.002
FUNCTION = tiny_packages.function(
    (20.0, (0.9, 0.2, 0.1), 0.0), (60.0, (0.3, 0.8, 0.1), 0.3), (90.0, (0.1, 0.2, 0.9), 0.05), reference_mm=2.0
)


def scan(shift_mm: float = 0.0) -> Volume:
    """An oblique scan of smooth hills, with a slope and unlike spacings, some of which reach the border."""
    grid = Grid(
        shape_zyx=(14, 19, 23),
        spacing_mm_zyx=(1.5, 1.0, 0.75),
        origin_mm_xyz=(5.0 + shift_mm, -7.0, 11.0),
        direction=((0.8, -0.6, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0)),
        extent_mm_zyx=(21.0, 19.0, 17.25),
    )
    z, y, x = np.indices(grid.shape_zyx)
    hills = np.sin(0.55 * z + 0.3) * np.sin(0.4 * y) * np.sin(0.33 * x + 0.2)
    return Volume(np.rint(900 + 800 * hills).astype(np.int16), grid, 0.1, -70.0)


def judged(scan_of_vtk: Volume, blend, function=FUNCTION, projection="orthographic") -> list[WitnessView]:
    """What VTK says of pictures of the scan, if it draws another one or another function."""
    grid = scan().grid
    views = standard_views(grid, projection)
    drawn = draw_views(scan_of_vtk, function, blend, list(views.values()), pixels=SIZE, scratch=judged.folder)
    oracle = COMPOSITINGS["maximum" if blend == "maximum" else "emission-absorption"].oracle
    medium = Medium(scan(), FUNCTION)
    found = []
    for number, (name, camera) in enumerate(views.items()):
        matrix = camera.box_from_clip(grid, 1.0)
        truth = oracle([medium], matrix, (SIZE, SIZE)).rgba
        found.append(compared(name, (drawn.coarse[number], drawn.fine[number]), truth, truth, TOLERANCE))
    return found


@pytest.fixture(autouse=True)
def _folder(tmp_path) -> None:
    judged.folder = tmp_path


@pytest.mark.long
@pytest.mark.parametrize(
    ("blend", "projection"), [("composite", "orthographic"), ("composite", "perspective"), ("maximum", "orthographic")]
)
def test_vtk_agrees_with_the_oracle_within_its_own_error(blend, projection) -> None:
    found = judged(scan(), blend, projection=projection)
    assert [view.passed for view in found] == [True] * 9
    # The bound must say something: half a voxel changes 0.03 and more.
    assert max(view.bound for view in found) < 0.02


@pytest.mark.long
def test_vtk_draws_micrometres_as_it_draws_millimetres(tmp_path) -> None:
    own, small = scan(), 1e-4
    grid = own.grid.model_copy(
        update={
            name: tuple(small * length for length in getattr(own.grid, name))
            for name in ("spacing_mm_zyx", "origin_mm_xyz", "extent_mm_zyx")
        }
    )
    points = tuple(
        point.model_copy(update={"extinction_per_mm": point.extinction_per_mm / small}) for point in FUNCTION.points
    )
    scaled = replace(own, grid=grid), FUNCTION.model_copy(update={"points": points})
    fine = [
        draw_views(
            volume,
            function,
            "composite",
            list(standard_views(volume.grid, "orthographic").values()),
            pixels=SIZE,
            scratch=tmp_path,
        ).fine
        for volume, function in ((own, FUNCTION), scaled)
    ]
    np.testing.assert_allclose(fine[1], fine[0], atol=2 / 255)


WRONG = {
    "half a voxel": (scan(0.375), FUNCTION),
    "twice the extinction": (
        scan(),
        FUNCTION.model_copy(
            update={
                "points": tuple(
                    point.model_copy(update={"extinction_per_mm": 2 * point.extinction_per_mm})
                    for point in FUNCTION.points
                )
            }
        ),
    ),
    "red for blue": (
        scan(),
        FUNCTION.model_copy(
            update={
                "points": tuple(point.model_copy(update={"colour": point.colour[::-1]}) for point in FUNCTION.points)
            }
        ),
    ),
    "mirrored": (replace(scan(), stored=np.ascontiguousarray(scan().stored[:, :, ::-1])), FUNCTION),
}


@pytest.mark.long
@pytest.mark.parametrize("wrong", WRONG)
def test_vtk_does_not_agree_with_what_is_wrong(wrong) -> None:
    found = judged(WRONG[wrong][0], "composite", WRONG[wrong][1])
    assert any(not view.passed for view in found)


def test_a_package_whose_picture_is_beyond_the_tolerance_is_not_agreed_with() -> None:
    truth = np.full((8, 8, 4), 0.5)
    near = compared("a", (truth, truth), truth, truth + 0.003, tolerance=0.002)
    far = compared("a", (truth, truth), truth, truth + 0.005, tolerance=0.002)
    assert (near.passed, far.passed) == (True, False)


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> Report:
    folder = tmp_path_factory.mktemp("witnessed")
    scene = write_kind(folder, "classified")
    return validate(built(folder, scene), folder / "report", picture_size=32, witness=True)


@pytest.mark.long
def test_validation_asks_the_witness_and_the_page_shows_what_it_says(report) -> None:
    assert report.witness is not None
    (program,) = report.witness.programs
    assert len(program.views) == 9
    assert report.witness.renderer.startswith("VTK 9")
    shown = page(report)
    assert 'id="witness"' in shown
    assert "agrees with the truth and with the package in all its views" in shown
    assert program.picture in shown


@pytest.mark.long
def test_vtk_agrees_with_a_package_that_follows_from_the_scan(report) -> None:
    assert report.verdict.disagreeing == ()
    assert all(view.truth_rmse <= view.bound for program in report.witness.programs for view in program.views)


def test_a_witness_that_disagrees_fails_the_package(report) -> None:
    verdict = judge(report.programs, report.tolerance, disagreeing=("raycast-shell",))
    assert not verdict.passed
    error = error_of_verdict(report.model_copy(update={"verdict": verdict}), Path("tried.volpkg"), Path("report"))
    assert error.code == "VP6042"
    assert "raycast-shell" in str(error)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"scan": replace(scan(), normals="central")}, "lit"),
        ({"scan": replace(scan(), nearest=True)}, "labels"),
        ({"is_of_several": True}, "several volumes"),
        (
            {"scan": SimpleNamespace(normals=None, nearest=False, stored=SimpleNamespace(size=MOST_VOXELS + 1))},
            "voxels",
        ),
        ({"compositing": "average"}, "average"),
        ({"has_baked_light": lambda _: True}, "path tracing judges it"),
    ],
)
def test_what_vtk_cannot_draw_is_named_with_the_reason(changes, reason) -> None:
    sound = {"scan": scan(), "is_of_several": False, "compositing": "maximum", "has_baked_light": lambda _: False}
    bench = SimpleNamespace(subject=SimpleNamespace(**sound | changes))
    asked = Statement(bench, SimpleNamespace(name="raycast", transfer="shell"), None)
    said = ask_witness([asked], "anterior", Path("/nowhere"))
    assert said.programs == ()
    assert said.missing[0].item == "raycast"
    assert reason in said.missing[0].reason


def test_a_second_reading_names_light_that_was_computed_once() -> None:
    subject = SimpleNamespace(has_baked_light=lambda name: name == "shell")
    asked = Statement(SimpleNamespace(subject=subject), SimpleNamespace(transfer="shell"), None)
    with pytest.raises(CannotWitnessError, match="path tracing of the scan judges it"):
        list(second_reading._pictures(asked, {}, None, {}))


def test_a_second_reading_names_segments() -> None:
    asked = Statement(SimpleNamespace(subject=None), SimpleNamespace(transfer="segments"), None)
    with pytest.raises(CannotWitnessError, match="it has segments"):
        list(second_reading._pictures(asked, {"segments": {"name": "segments"}}, None, {}))


def test_a_preset_that_is_like_another_is_read_with_its_points(tmp_path) -> None:
    (tmp_path / "scene.toml").write_text('[source]\npath = "x"\n[[transfer]]\npreset = "ct-bone-photograph"\n')
    presets = Path(str(files("volprep.scene.presets")))
    (function,) = read_scene(tmp_path, tmp_path / "scene.toml", presets).functions
    assert list(function.values) == [point.value for point in load_preset("ct-bone").points]


def test_without_pyvista_vtk_is_named_as_missing(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    said = ask_witness([], "anterior", tmp_path)
    assert [each.item for each in said.missing] == ["VTK"]
    assert "pip install" in said.missing[0].reason


def test_a_second_reading_agrees_with_a_package_that_follows_from_the_scan(report) -> None:
    items = {check.item.split(" ")[0] for check in report.witness.checks}
    assert items >= {"grid", "voxels", "transfer", "cameras", "truth", "pictures"}
    assert report.witness.contradicted == ()
    assert "Second reading" in page(report)


def test_a_second_reading_that_disagrees_is_one_message(report) -> None:
    wrong = report.witness.checks[0].model_copy(update={"found": 1.0})
    witness = report.witness.model_copy(update={"checks": (wrong,)})
    verdict = judge(report.programs, report.tolerance, contradicted=witness.contradicted)
    assert not verdict.passed
    error = error_of_verdict(
        report.model_copy(update={"verdict": verdict, "witness": witness}), Path("a.volpkg"), Path("r")
    )
    assert error.code == "VP6060"
    assert wrong.item in str(error)


@pytest.mark.long
def test_a_vtk_that_fails_is_one_message(tmp_path) -> None:
    (tmp_path / "task.npz").write_bytes(b"no task")
    with pytest.raises(VolprepError, match="VP6041"):
        run_script("volume_pictures", tmp_path / "task.npz", tmp_path / "result.npz", seconds=60)


def test_a_vtk_that_hangs_is_ended(tmp_path) -> None:
    with pytest.raises(VolprepError, match=r"not ready after 0.05 s"):
        run_script("volume_pictures", tmp_path / "task.npz", tmp_path / "result.npz", seconds=0.05)
