"""What a manifest states of fidelity holds for views that made no part of it, and is found where it does not."""

import json

import numpy as np
import pytest
from tamper_scenes import write_kind
from tampering import Damaged, built

import volprep.validation.fidelity as of
from volprep.parts.fidelity.measure import MeasuredFidelity, ViewError, by_chance, cameras_from, spiral, stated
from volprep.truth.volume import Volume
from volprep.validation.fidelity import fidelity_findings
from volprep.validation.scan import find_scan, read_scan
from volprep_formats.grid import Grid
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.reader import Package
from volprep_formats.package.rules import contradictions
from volprep_formats.progress import Silent


def scans_of(path) -> dict[str, Volume]:
    found = find_scan(path, None)
    parts = channel_packages(Package.open(path))
    return {name: read_scan(part.manifest, found.spec_of(name), Silent()) for name, part in parts.items()}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A package of three levels that states its fidelity, and its scan."""
    folder = tmp_path_factory.mktemp("stated")
    scene = write_kind(folder, "fitted")
    scene.write_text("fidelity = true\n" + scene.read_text())
    path = built(folder, scene)
    return path, scans_of(path)


@pytest.mark.long
@pytest.mark.usefixtures("_measured_before")
def test_it_is_stated_for_each_level_and_holds_in_twenty_other_views(made, others) -> None:
    path, scans = made
    package = Package.open(path)
    records = package.manifest.fidelity
    assert [(each.transfer, each.level) for each in records] == [("shell", 0), ("shell", 1), ("shell", 2)]
    assert [each.rmse for each in records] == sorted(each.rmse for each in records)
    assert all(0 < each.rmse < each.maximum <= 1 and each.flip > 0 for each in records)
    assert records[2].pixels_per_voxel == pytest.approx(1.0, abs=0.07)
    assert [len(each.views) for each in others] == [20, 20, 20]
    assert [*fidelity_findings(package, scans, wanted=True)] == []


@pytest.fixture(scope="module")
def others(made) -> list[MeasuredFidelity]:
    """What 20 other views have."""
    path, scans = made
    return [*of._measured(Package.open(path), scans)]


@pytest.fixture
def _measured_before(others, monkeypatch) -> None:
    """The same views are not drawn again for each damage."""
    monkeypatch.setattr(of, "_measured", lambda *_: others)


@pytest.mark.long
@pytest.mark.usefixtures("_measured_before")
@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"rmse": 0.5}, "RMSE"),
        ({"maximum": 0.7}, "largest error"),
        ({"pixels_per_voxel": 2.0}, "pixels"),
        ({"flip": 0.5}, "FLIP"),
        ({"views": 2}, "views"),
    ],
)
def test_a_record_that_makes_a_level_better_is_found(made, tmp_path, change, problem) -> None:
    path, scans = made
    damaged = Damaged(path, tmp_path)
    record = damaged.manifest["fidelity"][2]
    ((name, factor),) = change.items()
    # The stated largest error is a bound, so that it takes more to be wrong.
    record[name] = 0.05 if name == "maximum" else record[name] * factor
    (damaged.path / "manifest.json").write_text(json.dumps(damaged.manifest))
    (found,) = fidelity_findings(Package.open(damaged.path), scans, wanted=True)
    assert found.code == "VP6044"
    assert found.item == "fidelity of level 2 with shell"
    assert problem in found.problem


@pytest.mark.usefixtures("_measured_before")
def test_a_record_that_is_missing_or_that_nobody_asked_for_is_found(made, tmp_path) -> None:
    path, scans = made
    (found,) = fidelity_findings(Package.open(path), scans, wanted=False)
    assert "does not ask" in found.problem
    damaged = Damaged(path, tmp_path)
    del damaged.manifest["fidelity"][1]
    (damaged.path / "manifest.json").write_text(json.dumps(damaged.manifest))
    (found,) = fidelity_findings(Package.open(damaged.path), scans, wanted=True)
    assert (found.item, found.problem) == ("fidelity of level 1 with shell", "is not stated")


def test_a_package_whose_scene_does_not_ask_states_nothing(tmp_path) -> None:
    path = built(tmp_path, write_kind(tmp_path, "mipmaps"))
    package = Package.open(path)
    assert package.manifest.fidelity == ()
    assert [*fidelity_findings(package, {}, wanted=False)] == []
    (found,) = fidelity_findings(package, {}, wanted=True)
    assert "no fidelity" in found.problem


def test_a_manifest_that_states_it_for_what_is_not_there_contradicts_itself(made) -> None:
    manifest = Package.open(made[0]).manifest
    first = manifest.fidelity[0]
    wrong = manifest.model_copy(
        update={"fidelity": (first, first, first.model_copy(update={"level": 7, "transfer": "bone"}))}
    )
    assert [*contradictions(manifest)] == []
    assert [*contradictions(wrong)] == [
        "the fidelity of level 0 with shell is stated 2 times",
        "a fidelity is stated for level 7, which is not among the levels",
        "a fidelity is stated for transfer function bone, which is not there",
    ]


def test_the_stated_largest_error_bounds_the_largest_of_twenty_as_often_as_it_says() -> None:
    """Largest errors by Gumbel's distribution: of 2000 packages, some two should have a view beyond."""
    chance = np.random.default_rng(5)
    exceeded = 0
    for _ in range(2000):
        largest = 0.2 + 0.03 * chance.gumbel(size=36)
        record = stated(
            MeasuredFidelity("a", 0, 8, 1.0, tuple(ViewError(0.01, float(each), 0.1) for each in largest[:16]))
        )
        exceeded += float(largest[16:].max()) > record.maximum
    assert exceeded <= 8


def test_the_stated_rmse_is_over_all_pixels_of_all_views() -> None:
    record = stated(MeasuredFidelity("a", 1, 8, 0.123456, (ViewError(0.03, 0.5, 0.2), ViewError(0.04, 0.5, 0.4))))
    assert record.rmse == 0.0354
    assert record.flip == 0.3
    assert record.maximum == 1.0
    assert record.pixels_per_voxel == 0.123


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_views_come_evenly_from_all_sides(projection) -> None:
    directions = spiral(16)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    # The mean of directions is near 0, and that of their squares a third along each axis.
    assert np.abs(directions.mean(axis=0)).max() < 0.06
    np.testing.assert_allclose((directions**2).mean(axis=0), 1 / 3, atol=0.03)
    grid = Grid.of((10, 15, 18), (1.5, 1.0, 0.75), (4.0, 5.0, 6.0))
    for camera, direction in zip(cameras_from(grid, directions, projection), directions, strict=True):
        forward = np.array(camera.forward) / np.linalg.norm(camera.forward)
        np.testing.assert_allclose(forward, -direction, atol=1e-9)


def test_chance_gives_the_same_views_again() -> None:
    one, other = (by_chance(20, np.random.default_rng(3)) for _ in range(2))
    assert np.array_equal(one, other)
    np.testing.assert_allclose(np.linalg.norm(one, axis=1), 1.0)
