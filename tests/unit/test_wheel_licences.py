"""What tools/wheel_licences.py adds to a wheel: the libraries that the SBOM lacks, and all licences."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("wheel_licences", ROOT / "tools" / "wheel_licences.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("copied", "original"),
    [
        ("libbz2-e4f501c8.so.1.0.4", "libbz2.so.1.0.4"),
        ("liblog4cplus-2-3cd2169a.0.so.3.4.7", "liblog4cplus-2.0.so.3.4.7"),
        ("libImath-3_1-ce3f14d3.so.29.5.0", "libImath-3_1.so.29.5.0"),
    ],
)
def test_a_copied_library_is_known_by_the_name_that_it_had(tool, copied, original) -> None:
    assert tool.original_name(copied) == original


def test_the_sbom_gets_what_it_lacks_and_nothing_twice(tool) -> None:
    sbom = {
        "components": [{"name": "volprep"}, {"name": "libtbb12"}],
        "dependencies": [{"ref": "volprep", "dependsOn": ["tbb"]}, {"ref": "tbb"}],
    }
    tool.complete(sbom, {"libbz2-1.0": "1.0.8-5+b1", "libtbb12": "2021.8"}, "3.1.0")
    assert [each["name"] for each in sbom["components"]] == ["volprep", "libtbb12", "libbz2-1.0", "nanobind"]
    added = sbom["components"][2]
    assert (added["version"], added["purl"]) == ("1.0.8-5+b1", "pkg:deb/debian/libbz2-1.0@1.0.8-5%2Bb1")
    assert sbom["dependencies"][0]["dependsOn"] == ["tbb", added["purl"], "pkg:pypi/nanobind@3.1.0"]
    assert [each["ref"] for each in sbom["dependencies"][2:]] == [added["purl"], "pkg:pypi/nanobind@3.1.0"]


def test_a_library_whose_licence_is_missing_stops_the_wheel(tool, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(tool, "DOCUMENTATION", tmp_path)
    (tmp_path / "libtbb12").mkdir()
    (tmp_path / "libtbb12" / "copyright").write_text("Apache-2.0")
    tool.add_licences(tmp_path / "good", {"libtbb12": "1"})
    assert (tmp_path / "good" / "libtbb12.txt").read_text() == "Apache-2.0"
    assert "Redistribution" in (tmp_path / "good" / "nanobind.txt").read_text()
    with pytest.raises(SystemExit, match="no licence of libbz2"):
        tool.add_licences(tmp_path / "bad", {"libbz2": "1"})
