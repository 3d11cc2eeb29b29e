"""What a manifest says about mipmaps must agree with its levels, programs and files."""

from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from tiny_packages import ES3, function, tiny_package

from volprep_formats.package.check import check
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.rules import contradictions

GREY = function((0.0, (0.5, 0.5, 0.5), 0.0), (255.0, (1.0, 1.0, 1.0), 1.0))


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    levels = [np.zeros(shape, np.uint8) for shape in ((9, 14, 1), (5, 7, 1), (3, 4, 1))]
    return tiny_package(tmp_path_factory.mktemp("mipmaps") / "p", levels, GREY, ES3, mipmaps=True)


def changed(manifest: Manifest, level: int, **fields) -> Manifest:
    textures = tuple(
        each.model_copy(update=fields) if (each.role, each.level) == ("volume", level) else each
        for each in manifest.textures
    )
    return manifest.model_copy(update={"textures": textures})


def test_a_package_with_mipmaps_agrees_with_itself(package) -> None:
    assert [each.shape_zyx for each in package.manifest.textures if each.role == "volume"] == [
        (12, 16, 1),
        (6, 8, 1),
        (3, 4, 1),
    ]
    sealed_or_not = [problem for problem in contradictions(package.manifest) if "sealed" not in problem]
    assert sealed_or_not == []


CASES = {
    "volume-scan-0.ktx2 holds 3 mipmaps, its textures are mipmaps [0, 2, 2]": {"level": 1, "mipmap": 2},
    "volume-scan-0.ktx2 holds ('r8unorm', (6, 8, 1), '3d'), the manifest says ('r8unorm', (6, 7, 1), '3d')": {
        "level": 1,
        "shape_zyx": (6, 7, 1),
    },
    "volume-scan-0.ktx2 holds ('r8unorm', (3, 4, 1), '3d'), the manifest says ('r16float', (3, 4, 1), '3d')": {
        "level": 2,
        "format": "r16float",
    },
}


def said_of(package, manifest: Manifest, folder: Path) -> str:
    copytree(package.path, folder)
    (folder / "manifest.json").write_text(manifest.model_dump_json(exclude_none=True), encoding="utf-8")
    return "\n".join(finding.summary for finding in check(folder))


@pytest.mark.parametrize("says", CASES)
def test_mipmaps_that_contradict_their_file_are_found_out(package, tmp_path, says) -> None:
    assert says in said_of(package, changed(package.manifest, **CASES[says]), tmp_path / "p")


def test_a_file_with_another_number_of_mipmaps_is_a_finding(package, tmp_path) -> None:
    fewer = tuple(each for each in package.manifest.textures if (each.role, each.level) != ("volume", 1))
    manifest = package.manifest.model_copy(update={"textures": fewer})
    assert "holds 3 mipmaps, its textures are mipmaps [0, 2]" in said_of(package, manifest, tmp_path / "p")
