"""A second scan over a first one without a scene: `volprep build ct/ --with pet/`."""

from pathlib import Path

import numpy as np
import pytest
from command_line import volprep
from judged import validate
from pet_ct import HOT_MM, write_ct, write_pet
from scene_builds import view_of

from volprep.pipeline.build import build, plan_build
from volprep.render.renderer import Renderer
from volprep.scene.request import Request, request_for_source
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent


@pytest.fixture(scope="module")
def ct(tmp_path_factory) -> Path:
    return write_ct(tmp_path_factory.mktemp("ct") / "ct")


def over(ct: Path, pet: Path) -> Request:
    return request_for_source(ct).with_veil(pet)


def refusal(request: Request) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        plan_build(request, Silent())
    return error.value


@pytest.fixture(scope="module")
def package(ct, tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp("fused")
    build(over(ct, write_pet(folder / "pet")), folder / "fused.volpkg", Silent())
    return Package.open(folder / "fused.volpkg")


def test_uptake_is_a_veil_over_a_translucent_body(package) -> None:
    first = package.manifest.pictures[0]
    assert (first.name, [medium.transfer for medium in first.media]) == ("fused", ["body", "veil"])
    (said,) = [item.reason for item in package.manifest.plan if item.name == "first look"]
    assert said.startswith("recognised as uptake, coloured from a fifth of its largest value on over a CT;")


def test_the_hot_spots_are_red_where_they_are(package) -> None:
    box = package.manifest.box
    matrix = view_of(box, "anterior")
    with Renderer(package, target="rgba32f") as renderer:
        picture = renderer.render(matrix, (96, 96))
    warmth = (picture[..., 0] - picture[..., 2]) / np.maximum(picture[..., 3], 0.1)
    for centre, _ in HOT_MM:
        clip = np.linalg.inv(matrix) @ np.linalg.inv(box.world_from_box) @ [*centre, 1.0]
        column, row = round((clip[0] + 1) * 48 - 0.5), round((1 - clip[1]) * 48 - 0.5)
        spot = warmth[row - 1 : row + 2, column - 1 : column + 2].mean()
        assert spot > 1.5 * np.median(warmth[picture[..., 3] > 0.3])


@pytest.mark.long
def test_the_default_picture_is_within_the_default_tolerance(package, tmp_path) -> None:
    assert validate(package, tmp_path / "report", picture_size=96).verdict.passed


@pytest.mark.parametrize(("frame", "says"), [("1.2.840.99", "are …1.2.840.99 and …"), (None, "are none and …")])
def test_another_frame_of_reference_is_refused_and_so_is_none(ct, tmp_path, frame, says) -> None:
    error = refusal(over(ct, write_pet(tmp_path / "pet", frame)))
    assert error.code == "VP1240"
    assert "54×42×26 voxels instead of 72×56×40" in str(error)
    assert says in str(error)


def test_a_file_that_does_not_say_where_it_lies_is_refused(ct, tmp_path) -> None:
    np.save(tmp_path / "map.npy", np.arange(24, dtype=np.float32).reshape(2, 3, 4))
    error = refusal(over(ct, tmp_path / "map.npy"))
    assert error.code == "VP1240"
    assert "npy files do not say where voxels lie" in str(error)


def test_a_second_scan_needs_a_scan_alone(ct, tmp_path) -> None:
    with pytest.raises(VolprepError) as error:
        over(ct, tmp_path).with_veil(tmp_path)
    assert error.value.code == "VP3078"
    with pytest.raises(VolprepError, match="preset"):
        request_for_source(ct).with_preset("ct-bone").with_veil(tmp_path)


def test_the_command_line_has_it(ct, tmp_path) -> None:
    write_pet(tmp_path / "pet")
    done = volprep("plan", ct, "--with", tmp_path / "pet", "--json")
    assert done.returncode == 0
    assert '"fused"' in done.stdout
