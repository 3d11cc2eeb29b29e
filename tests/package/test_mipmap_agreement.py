"""What a manifest says about mipmaps must agree with its levels, programs and files."""

import numpy as np
import pytest
from tiny_packages import ES3, function, tiny_package

from volprep_formats.package.check import check
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.mipmaps.rules import mipmap_contradictions
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
    "volume-scan-0.ktx2 is shared by 3 textures, which are not its mipmaps 0 to 2 in order": {"level": 1, "mipmap": 2},
    "volume-scan-0.ktx2 holds mipmaps, but volume-scan-1 is no volume in a 3D texture": {
        "level": 1,
        "dimension": "2d",
    },
    "volume-scan-0.ktx2 holds mipmap 1 of (6, 7, 1) texels, which is wrong for (12, 16, 1)": {
        "level": 1,
        "shape_zyx": (6, 7, 1),
    },
    "volume-scan-0.ktx2 holds mipmaps of several formats": {
        "level": 2,
        "format": "r16float",
    },
    "texture volume-scan-0 has (8, 16, 1) texels, its level (9, 14, 1) voxels": {"level": 0, "shape_zyx": (8, 16, 1)},
}


@pytest.mark.parametrize("says", CASES)
def test_mipmaps_that_contradict_their_texture_are_found_out(package, says) -> None:
    assert says in list(mipmap_contradictions(changed(package.manifest, **CASES[says])))


def test_texture_coordinates_that_are_those_of_the_voxels_are_found_out(package) -> None:
    (picture,) = package.manifest.pictures
    first = package.manifest.levels[0]
    scale = tuple(1 / (n * h) for n, h in zip(first.grid.shape_zyx[::-1], first.grid.spacing_mm_zyx[::-1], strict=True))
    drawing, *others = picture.drawings
    values = (drawing.values[0].model_copy(update={"numbers": scale}), *drawing.values[1:])
    wrong = picture.model_copy(update={"drawings": (drawing.model_copy(update={"values": values}), *others)})
    problems = contradictions(package.manifest.model_copy(update={"pictures": (wrong,)}))
    assert f"picture {picture.name} at level 0 has texture_from_box that does not follow from its level" in [*problems]


def test_a_file_with_another_number_of_mipmaps_is_a_finding(tmp_path) -> None:
    folder = tmp_path / "p"
    made = tiny_package(folder, [np.zeros((8, 8, 8), np.uint8), np.zeros((4, 4, 4), np.uint8)], GREY, ES3, mipmaps=True)
    manifest = made.manifest
    fewer = manifest.model_copy(update={"textures": tuple(each for each in manifest.textures if each.level != 1)})
    (folder / "manifest.json").write_text(fewer.model_dump_json(exclude_none=True), encoding="utf-8")
    two, one = (f"('r8unorm', (8, 8, 8), '3d', {mipmaps})" for mipmaps in (2, 1))
    says = f"volume-scan-0.ktx2 holds {two}, the manifest says {one}"
    assert any(says in finding.summary for finding in check(folder))
