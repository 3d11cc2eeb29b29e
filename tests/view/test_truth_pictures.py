"""Truth pictures beside a report: what a page needs to measure a device, and nothing that is not the truth."""

import json
import zlib

import numpy as np
import pytest

from volprep.truth.camera import standard_views
from volprep.truth.decoded import level_volume
from volprep.validation.results.truth import TruthIndex
from volprep.validation.subjects.subject import Subject
from volprep_formats.light_pictures import light_bytes
from volprep_formats.package.digest import manifest_sha256
from volprep_formats.package.reader import Package


def decoded(data: bytes, size: int) -> np.ndarray:
    """The slow twin: sample by sample from the left, as the description of the file says."""
    plain = zlib.decompress(data)
    half = len(plain) // 2
    picture = np.zeros((size, size, 4))
    for number in range(half):
        plane, rest = divmod(number, size * size)
        y, x = divmod(rest, size)
        step = plain[number] * 256 + plain[half + number]
        left = picture[y, x - 1, plane] if x else 0
        picture[y, x, plane] = (left + step) % 65536
    return picture / 65535


@pytest.fixture(scope="module")
def index(phantom) -> TruthIndex:
    text = (phantom.report_folder / "truth" / "truth.json").read_text(encoding="utf-8")
    return TruthIndex.model_validate_json(text)


def test_a_picture_comes_back_within_half_a_step_of_16_bits() -> None:
    picture = np.random.default_rng(3).random((7, 7, 4))
    picture[2, 3] = (1.5, -0.5, 0.0, 1.0)
    assert np.abs(decoded(light_bytes(picture), 7) - np.clip(picture, 0, 1)).max() <= 0.5 / 65535 + 1e-12


def test_the_list_is_of_the_package_that_was_validated(phantom, index) -> None:
    assert index.manifest_sha256 == manifest_sha256(phantom.package) == phantom.report.package.manifest_sha256
    assert (index.picture_size, index.step_mm) == (phantom.report.picture_size, phantom.report.step_mm)


def test_every_view_has_a_picture_and_nothing_else_lies_there(phantom, index) -> None:
    files = [view.file for program in index.programs for view in program.views]
    assert len(files) == len(set(files)) == 2 * 9
    assert {path.name for path in (phantom.report_folder / "truth").iterdir()} == {"truth.json", *files}
    for program in index.programs:
        assert program.sweep_view in {view.view for view in program.views}


def test_points_are_those_of_the_sweep(phantom, index) -> None:
    for program, result in zip(index.programs, phantom.report.programs, strict=True):
        found = [(point.level, point.step_mm) for point in program.points]
        assert found == [(point.level, point.step_mm) for point in result.sweep.points]
        assert len(found) >= 6


def test_a_picture_is_the_oracle_of_the_scan_and_its_matrix_that_of_the_view(phantom, index) -> None:
    package = Package.open(phantom.package)
    views = standard_views(package.manifest.levels[0].grid, "orthographic")
    program = index.programs[1]
    view = next(each for each in program.views if each.view == "posterior-left")
    camera = views[view.view].box_from_clip(package.manifest.levels[0].grid, aspect=1.0)
    assert np.array_equal(np.reshape(view.box_from_clip, (4, 4)), camera)
    picture = decoded((phantom.report_folder / "truth" / view.file).read_bytes(), index.picture_size)
    shown = json.loads((phantom.report_folder / "report.json").read_text())["programs"][1]["views"]
    data_rmse = next(each["data"]["rmse"] for each in shown if each["view"] == view.view)
    on_data = (
        Subject(package, level_volume(package, 0), index.picture_size).on_data(program.transfer, view.view, 0).rgba
    )
    # The picture is rounded to 16 bits, which moves the RMSE by half a step of them at most; it was seen to move it
    # from 2.678e-5 to 2.684e-5.
    assert float(np.sqrt(np.mean((picture - on_data) ** 2))) == pytest.approx(data_rmse, abs=0.5 / 65535)


def test_a_report_with_truth_pictures_is_replaced_by_the_next(phantom, tmp_path) -> None:
    from volprep.validation.folder import report_folder

    place = tmp_path / "old.report"
    for _ in range(2):
        with report_folder(place) as folder:
            folder.truth("truth.json", b"{}")
    assert [path.name for path in (place / "truth").iterdir()] == ["truth.json"]
