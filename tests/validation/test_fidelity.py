"""What a manifest states of fidelity holds for views that made no part of it, and is found where it does not."""

import json

import pytest
from tamper_scenes import write_kind
from tampering import Damaged, built

import volprep.validation.checks.fidelity as of
from volprep.parts.fidelity.measured import MeasuredFidelity
from volprep.truth.volume import Volume
from volprep.validation.checks.fidelity import fidelity_findings
from volprep.validation.subjects.scan import find_scan, read_scan
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.reader import Package
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
    (picture,) = package.manifest.pictures
    records = [drawing.fidelity for drawing in picture.drawings]
    assert (picture.name, [drawing.level for drawing in picture.drawings]) == ("shell", [0, 1, 2])
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
    record = damaged.manifest["pictures"][0]["drawings"][2]["fidelity"]
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
    del damaged.manifest["pictures"][0]["drawings"][1]["fidelity"]
    (damaged.path / "manifest.json").write_text(json.dumps(damaged.manifest))
    (found,) = fidelity_findings(Package.open(damaged.path), scans, wanted=True)
    assert (found.item, found.problem) == ("fidelity of level 1 with shell", "is not stated")


def test_a_package_whose_scene_does_not_ask_states_nothing(tmp_path) -> None:
    path = built(tmp_path, write_kind(tmp_path, "mipmaps"))
    package = Package.open(path)
    assert all(drawing.fidelity is None for _, drawing in package.manifest.drawings)
    assert [*fidelity_findings(package, {}, wanted=False)] == []
    (found,) = fidelity_findings(package, {}, wanted=True)
    assert "no fidelity" in found.problem
