"""volprep validate, from the package to the report, on a small phantom with two transfer functions."""

import json
import shutil
from pathlib import Path
from unittest.mock import patch

import jsonschema
import numpy as np
import OpenImageIO
import pytest
from command_line import volprep
from judged import validate
from phantom_scene import SHAPE_ZYX, SPACING_MM_ZYX, phantom, write_phantom_scene
from scene_builds import built

from volprep.pipeline.origin import origin_path
from volprep.truth.camera import standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.picture import encoded
from volprep.truth.volume import Volume
from volprep.validation.comparison import coarse_levels as others
from volprep.validation.comparison import views
from volprep.validation.folder import default_report_path
from volprep.validation.results.report import Report
from volprep.validation.subjects.scan import find_scan, read_scan
from volprep.validation.subjects.subject import DRAFT_TOLERANCE
from volprep.validation.verdicts.verdict import share_of
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

SCHEMA = Path(__file__).parents[2] / "formats" / "schemas" / "report.schema.json"
SIZE = 64
"""Pixels along an edge: with fewer, single rays decide how the error of a picture falls."""


class Counted:
    """Progress that remembers how much was announced and how much was done."""

    def __init__(self) -> None:
        self.tasks: list[list[object]] = []

    def start(self, task: str, total: int) -> None:
        self.tasks.append([task, total, 0])

    def advance(self, units: int = 1) -> None:
        self.tasks[-1][2] += units


@pytest.fixture(scope="module")
def progress() -> Counted:
    return Counted()


@pytest.fixture(scope="module")
def folder(built_package, tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("report") / "phantom.report"


@pytest.fixture(scope="module")
def report(built_package, folder, progress) -> Report:
    """The report of the phantom's package, for each profile."""
    return validate(built_package, folder, progress, picture_size=SIZE)


@pytest.fixture
def package(built_package, tmp_path) -> Path:
    """A copy of the package, with its origin beside it, to be broken."""
    shutil.copytree(built_package, tmp_path / "phantom.volpkg")
    shutil.copy(origin_path(built_package), tmp_path)
    return tmp_path / "phantom.volpkg"


@pytest.mark.long(keep=1)
def test_the_phantom_is_within_the_tolerance_in_all_views_of_both_transfer_functions(report) -> None:
    assert report.verdict.passed
    assert report.verdict.views == 18
    assert [program.transfer for program in report.programs] == ["shell", "core"]
    views = list(standard_views(report.package.manifest.levels[0].grid))
    for program in report.programs:
        assert [view.view for view in program.views] == views


@pytest.mark.long(keep=1)
def test_the_data_are_valid_by_the_schema(report, folder) -> None:
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    data = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(data)
    assert Report.model_validate(data) == report


@pytest.mark.long(keep=1)
def test_every_picture_is_there_and_none_without_a_name(report, folder) -> None:
    views = {name for program in report.programs for view in program.views for _, name in view.pictures}
    levels = [compared.picture for program in report.programs for compared in program.levels]
    counted = {program.empty_space.picture for program in report.programs if program.empty_space}
    kept = {each.picture for program in report.programs for each in program.kept_light}
    named = views | set(levels) | counted | kept
    assert {f"pictures/{path.name}" for path in (folder / "pictures").iterdir()} == named
    assert len(views) == 2 * 9 * 5
    assert len(set(levels)) == len(levels) > 0
    page = (folder / "index.html").read_text(encoding="utf-8")
    for name in named:
        assert f'src="{name}"' in page


@pytest.mark.long(keep=1)
def test_the_parts_of_the_error_agree_with_the_whole(report) -> None:
    for program in report.programs:
        for view in program.views:
            # The triangle inequality holds for both norms.
            assert view.total.rmse <= view.data.rmse + view.drawing.rmse + 1e-12
            assert view.total.maximum <= view.data.maximum + view.drawing.maximum + 1e-12
            assert 0 < view.truth_bound <= DRAFT_TOLERANCE
            # Where a draft does not decide, and in the view of the sweep, it is sharp.
            if share_of(view.seen, report.tolerance) > 0.75 or view.view == program.sweep.view:
                assert view.truth_bound <= report.oracle_tolerance
        parts = program.sweep.breakdown
        drawing = next(view for view in program.views if view.view == program.sweep.view).drawing
        others = [part.rmse for part in (parts.table, parts.quadrature, parts.termination, parts.target) if part]
        assert len(others) == 4
        assert drawing.rmse <= sum(others) + 1e-12


@pytest.mark.long
@pytest.mark.parametrize(("sure", "drafted"), [(1.0, 8), (0.0, 0)])
def test_a_truth_is_sharp_where_a_draft_could_decide(tmp_path, built_package, sure, drafted) -> None:
    with patch.object(views, "_SURE", sure):
        report = validate(built_package, tmp_path / "r", picture_size=64)
    (shell,) = (each for each in report.programs if each.transfer == "shell")
    assert sum(view.truth_bound > report.oracle_tolerance for view in shell.views) == drafted


@pytest.mark.long
def test_the_truth_of_a_level_near_its_limit_is_sharp(tmp_path, built_package) -> None:
    with patch.object(others, "_unsure", lambda viewed, *_: [*viewed.truths]):
        sharp = validate(built_package, tmp_path / "sharp", picture_size=64)
    drafted = validate(built_package, tmp_path / "drafted", picture_size=64)
    for one, other in zip(sharp.programs, drafted.programs, strict=True):
        for levels in zip(one.others, other.others, strict=True):
            for first, second in zip(*(level.views for level in levels), strict=True):
                assert first.seen.rmse == pytest.approx(second.seen.rmse, abs=DRAFT_TOLERANCE)
                assert first.seen.flip == pytest.approx(second.seen.flip, abs=1e-3)
    assert sharp.programs[0].others[0].views[0].seen != drafted.programs[0].others[0].views[0].seen


@pytest.mark.long(keep=1)
def test_the_sweep_has_six_steps_at_the_finest_level_and_covers_every_level(report) -> None:
    for program in report.programs:
        levels = [level.index for level in report.package.manifest.levels]
        assert [floor.level for floor in program.sweep.floors] == levels
        steps = [point.step_ratio for point in program.sweep.points if point.level == 0]
        assert steps == [4.0, 2.0, 1.0, 0.5, 0.25, 0.125]
        for point in program.sweep.points:
            drawings = report.package.manifest.picture(program.transfer).drawings
            (nominal_mm,) = (each.step_mm for each in drawings if each.level == point.level)
            assert point.step_mm == pytest.approx(point.step_ratio * nominal_mm)
            assert point.draw is None or (point.draw.low > 0 and point.draw.pictures >= 7)
        counts = [point.samples_mean for point in program.sweep.points if point.level == 0]
        assert counts == sorted(counts)
        assert counts[-1] / counts[0] == pytest.approx(32, rel=0.05)


@pytest.mark.long(keep=1)
def test_no_coarser_level_is_clearly_nearer_to_the_truth_than_level_0(report) -> None:
    for program in report.programs:
        floors = [floor.data.rmse for floor in program.sweep.floors]
        # In this smooth scan 8 bits are most of the error: a refined level, whose table is fitted, is within 2 % of it.
        assert floors[0] < 1.05 * min(floors)
        assert floors[0] < floors[-1]


@pytest.mark.long(keep=1)
def test_the_quadrature_error_of_the_smooth_transfer_function_is_of_second_order(report) -> None:
    sweep = report.programs[0].sweep
    assert sweep.float_target == "rgba32f"
    finest = [point.quadrature for point in sweep.points if point.level == 0][-1]
    assert finest is not None
    # 1e-5 at an eighth of 0.375 mm, half a voxel.
    assert finest.rmse < 1e-5 * max(1.0, report.step_mm / 0.375) ** 2
    if report.package.manifest.profile.name == "gles3":
        # Finer steps come near to what float32 rounds.
        assert np.mean(sweep.convergence.slopes[:2]) == pytest.approx(2.0, abs=0.25), sweep.convergence
    # The 8-bit table of the other profile has a kink at each entry: its slopes lie below 2.
    assert np.mean(sweep.convergence.slopes) > 0.5


@pytest.mark.long(keep=1)
def test_progress_is_told_to_the_end(report, progress) -> None:
    assert len(progress.tasks) >= 5
    assert [task for task in progress.tasks if task[1] != task[2]] == []


@pytest.mark.long(keep=1)
def test_the_report_names_what_it_validated_and_on_what(report, built_package) -> None:
    assert report.package.file_name == "phantom.volpkg"
    files = [path for path in built_package.rglob("*") if path.is_file()]
    assert report.package.size_bytes == sum(path.stat().st_size for path in files)
    assert report.driver.version.startswith("OpenGL ES")
    assert report.cost.source_bytes == phantom().nbytes
    parts = {"all", "checking", "comparing", "counting", "deriving", "drawing", "oracle", "timing"}
    assert set(report.cost.seconds) == parts
    assert report.cost.seconds["all"] > sum(report.cost.seconds.values()) / 3


@pytest.mark.long
def test_two_runs_differ_in_times_only_and_json_is_the_report_itself(report, package, tmp_path) -> None:
    done = volprep("validate", package, "--size", str(SIZE), "--json", "--report", tmp_path / "elsewhere")
    assert done.returncode == ExitStatus.OK, done.stderr
    again = Report.model_validate_json(done.stdout)
    assert again == Report.model_validate_json((tmp_path / "elsewhere" / "report.json").read_bytes())
    assert not (tmp_path / "phantom.report").exists()
    assert timeless(again) == timeless(report)


def timeless(report: Report) -> dict:
    data = report.model_dump(exclude={"cost"})
    for program in data["programs"]:
        del program["sweep"]["timed_size"]  # fewer pixels where drawing is slow
        for point in program["sweep"]["points"]:
            del point["draw"]
        for way in (program["empty_space"] or {"ways": ()})["ways"]:
            del way["draw"]
    return data


def test_the_report_lies_beside_the_package_unless_told_otherwise(tmp_path) -> None:
    assert default_report_path(tmp_path / "brain.volpkg") == tmp_path.resolve() / "brain.report"


@pytest.fixture(scope="module")
def beyond(tmp_path_factory) -> Path:
    """A package of one transfer function and one level that its scene's tolerance does not let pass."""
    folder = tmp_path_factory.mktemp("beyond")
    scene = write_phantom_scene(folder)
    text = scene.read_text()
    text = text[: text.rindex("[[transfer]]")].replace("coarsest_longest_axis = 16", "coarsest_longest_axis = 64")
    scene.write_text(text + "[quantize]\nbits = 8\n[tolerance]\nrmse = 0.0001\nmaximum = 1.0\n")
    package = folder / "phantom.volpkg"
    built(scene, package)
    return package


def test_a_tolerance_that_is_not_kept_ends_with_status_1_and_the_worst_view(beyond, tmp_path) -> None:
    done = volprep("validate", beyond, "--size", "16", "--report", tmp_path / "report")
    assert done.returncode == ExitStatus.TOLERANCE, done.stderr
    assert "VP6011" in done.stderr
    report = Report.model_validate_json((tmp_path / "report" / "report.json").read_bytes())
    assert (report.verdict.passed, report.verdict.failed) == (False, 9)
    assert f"the worst is {report.verdict.worst_view} of program {report.verdict.worst_program}" in done.stderr
    assert f"RMSE {report.verdict.worst_rmse:.4g} (limit 0.0001)" in done.stderr
    assert done.stdout.count("beyond\n") == 10
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_json_stays_one_document_when_the_tolerance_is_not_kept(beyond, tmp_path) -> None:
    done = volprep("validate", beyond, "--size", "16", "--json", "--report", tmp_path / "report")
    assert done.returncode == ExitStatus.TOLERANCE
    assert not Report.model_validate_json(done.stdout).verdict.passed
    assert "VP6011" in done.stderr


@pytest.mark.long
def test_a_package_that_lacks_full_resolution_is_judged_by_its_finest_level_and_says_so(tmp_path) -> None:
    (tmp_path / "small.toml").write_text(
        'name = "small"\napi = "es3.0"\nmax_texture_size = 64\nmax_3d_texture_size = 32\ntexture_units = 8\n'
        'texture_formats = ["r8unorm", "r16float", "rgb8unorm", "rgba8unorm", "rgba16float"]\nindex_bits = 32\n'
        "max_texture_bytes = 9_000_000\n"
    )
    scene = write_phantom_scene(tmp_path, "small.toml", "box")
    scene.write_text(scene.read_text()[: scene.read_text().rindex("[[transfer]]")])
    built(scene, tmp_path / "phantom.volpkg")
    done = volprep("validate", tmp_path / "phantom.volpkg", "--size", "16", "--json")
    report = Report.model_validate_json(done.stdout)
    assert report.programs[0].level == 1
    assert any("full resolution is left out" in each for each in report.warnings)
    assert [each.level for each in report.programs[0].levels] == [1, 2]
    assert done.returncode == (ExitStatus.OK if report.verdict.passed else ExitStatus.TOLERANCE)


def test_quick_tells_a_whole_package_without_its_scan(package) -> None:
    origin_path(package).unlink()
    done = volprep("validate", package, "--quick")
    assert (done.returncode, done.stderr) == (ExitStatus.OK, "")
    assert "whole" in done.stdout


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("quick", [["--quick"], []])
def test_one_flipped_bit_in_a_texture_is_found(package, quick) -> None:
    (texture, *_) = [package / each.file for each in Package.open(package).manifest.textures if each.role == "volume"]
    data = bytearray(texture.read_bytes())
    data[-7] ^= 1
    texture.write_bytes(data)
    done = volprep("validate", package, *quick)
    assert done.returncode == ExitStatus.PACKAGE
    assert "VP6010" in done.stderr
    assert "VP4009" in done.stderr
    assert texture.name in done.stderr
    assert not (package.parent / "phantom.report").exists()


def test_a_folder_that_is_no_package_is_said_to_be_none(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP4001"):
        validate(tmp_path / "nothing.volpkg", tmp_path / "report")
    assert list(tmp_path.iterdir()) == []


def test_another_scan_is_refused(package, tmp_path) -> None:
    other = phantom()
    other[3, 5, 7] += 1
    other.tofile(tmp_path / "other.raw")
    with pytest.raises(VolprepError, match="VP6013") as caught:
        validate(package, tmp_path / "report", source=tmp_path / "other.raw")
    assert caught.value.status == ExitStatus.SOURCE
    assert not (tmp_path / "report").exists()


def test_the_same_voxels_at_another_spacing_are_another_scan(package, tmp_path) -> None:
    scene = write_phantom_scene(tmp_path)
    scene.write_text(scene.read_text().replace("2.5, 0.75, 1.0", "2.5, 1.0, 0.75"))
    with pytest.raises(VolprepError, match="VP6013"):
        validate(package, tmp_path / "report", source=scene)


def test_without_an_origin_the_scan_must_be_named(package, tmp_path) -> None:
    origin_path(package).unlink()
    with pytest.raises(VolprepError, match="VP6012"):
        validate(package, tmp_path / "report")


def test_a_scene_tells_the_scan_and_the_size_of_the_pictures(package, tmp_path) -> None:
    origin_path(package).unlink()
    (tmp_path / "moved").mkdir()
    scene = write_phantom_scene(tmp_path / "moved", more="\n[render]\npicture_size = 24\n")
    found = find_scan(package, scene)
    assert found.picture_size == 24
    scan = read_scan(Package.open(package).manifest, found.spec_of(""), Silent())
    np.testing.assert_array_equal(scan.stored, phantom())


def test_a_moved_scan_is_read_as_the_origin_says(package, tmp_path) -> None:
    phantom().tofile(tmp_path / "moved.raw")
    found = find_scan(package, tmp_path / "moved.raw")
    np.testing.assert_array_equal(
        read_scan(Package.open(package).manifest, found.spec_of(""), Silent()).stored, phantom()
    )


@pytest.mark.long(keep=1)
def test_the_truth_is_the_oracle_on_the_scan_and_not_on_what_the_package_made_of_it(report, folder) -> None:
    manifest = report.package.manifest
    scan = Grid.of(SHAPE_ZYX, SPACING_MM_ZYX)
    program = report.programs[0]
    function = next(each for each in manifest.transfer_functions if each.name == program.transfer)
    for view in program.views[:1] + program.views[-1:]:
        camera = standard_views(manifest.levels[0].grid)[view.view]
        truth = oracle_picture(Volume(phantom(), scan), function, camera.box_from_clip(scan, 1.0), (SIZE, SIZE))
        shown = OpenImageIO.ImageBuf(str(folder / view.pictures.truth_white)).get_pixels("uint8")
        np.testing.assert_array_equal(shown, encoded(truth.rgba, "white"))
        assert (shown < 250).mean() > 0.03


@pytest.mark.long(keep=1)
def test_the_picture_of_the_rendering_is_close_to_the_truth(report, folder) -> None:
    pictures = report.programs[0].views[0].pictures
    truth, drawn = (
        OpenImageIO.ImageBuf(str(folder / name)).get_pixels("uint8").astype(int)
        for name in (pictures.truth_black, pictures.drawn_black)
    )
    assert truth.max() > 40
    assert 20 * np.log10(255 / np.sqrt(np.mean((truth - drawn) ** 2.0))) > 30
