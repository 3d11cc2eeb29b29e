"""Studies of a package: a page and its data in a new folder."""

import json
from types import SimpleNamespace

import pytest

from volprep.lab import studies
from volprep.report.study import Study
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Tolerance
from volprep_formats.progress import Silent


@pytest.fixture
def study(monkeypatch) -> Study:
    monkeypatch.setattr(studies, "find_scan", lambda package, source: (package.name, source))
    monkeypatch.setattr(studies.Package, "open", lambda package: SimpleNamespace(manifest=package.name))

    def measure(manifest, judge, folder, _progress, picture_size):
        assert (manifest, judge, picture_size) == ("a.volpkg", ("a.volpkg", None), 32)
        (folder / "scan.raw").touch()
        return Tolerance(rmse=0.5), "<p>told</p>"

    return Study("told", "Told", measure)


def test_a_study_writes_its_page_and_its_data_and_leaves_no_scan(tmp_path, study) -> None:
    folder = tmp_path / "new"
    studies.write_study(study, tmp_path / "a.volpkg", folder, Silent(), picture_size=32)
    assert sorted(path.name for path in folder.iterdir()) == ["told.html", "told.json"]
    assert (folder / "told.html").read_text() == "<p>told</p>"
    assert json.loads((folder / "told.json").read_text())["rmse"] == 0.5
    assert list(tmp_path.iterdir()) == [folder]


def test_a_study_replaces_no_folder_with_files(tmp_path, study) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").touch()
    with pytest.raises(VolprepError, match="VP6021"):
        studies.write_study(study, tmp_path / "a.volpkg", tmp_path / "mine", Silent(), picture_size=32)
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.txt"]
