"""Voxels that no picture can show get one value, and no picture changes."""

import zlib
from pathlib import Path

import numpy as np
import pytest
from scene_builds import built
from scipy.ndimage import minimum_filter
from tamper_scenes import SCENE, write_kind

from volprep.parts.hidden_voxels import _numbered, flatten
from volprep.render.renderers import ray_caster_of
from volprep.truth.camera import standard_views
from volprep_formats.package.function_table import Table
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2

SHAPE_ZYX = (40, 44, 48)
LIT = '[render]\nlighting = "headlight"\n[lighting]\nnormals = "central"'


def packages(folder: Path, profile: str, more: str) -> list[Package]:
    """Build a noisy scan with a ball in one corner, with voxels flattened and without."""
    z, y, x = np.meshgrid(*map(np.arange, SHAPE_ZYX), indexing="ij")
    ball = 200.0 * np.exp(-((z - 9) ** 2 + (y - 11) ** 2 + (x - 10) ** 2) / 30.0)
    noise = np.random.default_rng(3).integers(0, 12, SHAPE_ZYX)
    made = []
    for wish in ("auto", "none"):
        place = folder / wish
        place.mkdir()
        (place / "tried.raw").write_bytes((ball + noise).astype(np.uint8).tobytes())
        given = {"profile": profile, "top": 'crop = "none"', "filter": "box"}
        text = SCENE.format(**given, more=f'[lab.textures]\nflatten = "{wish}"\n{more}')
        (place / "tried.toml").write_text(text.replace("[10, 15, 18]", str([*SHAPE_ZYX])))
        built(place / "tried.toml", place / "p.volpkg")
        made.append(Package.open(place / "p.volpkg"))
    return made


def texels(package: Package) -> list[np.ndarray]:
    volumes = [each for each in package.manifest.textures if each.role == "volume"]
    return [ktx2.decode(package.read_bytes(each.file), each.file).data[0] for each in volumes]


def kept(package: Package) -> bool:
    (item,) = [item for item in package.manifest.plan if item.kind == "flattened"]
    return item.kept


def twin(codes: np.ndarray, runs: list[tuple[int, int]], reach: int) -> np.ndarray:
    made = codes.copy()
    for first, last in runs:
        inside = ((codes >= first) & (codes <= last)).astype(np.uint8)
        made[minimum_filter(inside, 2 * reach + 1, mode="constant", cval=1) == 1] = first
    return made


@pytest.mark.parametrize("reach", [1, 2])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_the_voxels_that_are_flattened_are_those_of_the_slow_twin(reach, dtype) -> None:
    chance = np.random.default_rng(reach)
    codes = chance.integers(0, 40, (7, 11, 13)).astype(dtype)
    codes[1:6, 2:9, 3:12] = chance.integers(90, 110, (5, 7, 9))
    runs = [(0, 39), (90, 109)]
    made = flatten(codes, runs, reach)
    assert np.array_equal(made, twin(codes, runs, reach))
    assert (made == 90).any()
    assert (made != codes).any()


def test_a_function_is_hidden_where_it_is_zero_and_an_entry_away_from_where_it_is_not() -> None:
    values = np.array([10.0, 20.0, 30.0, 40.0, 60.0])
    table = Table(values, np.zeros((5, 3)), np.array([0.0, 0.0, 1.0, 0.0, 0.0]))
    numbers = _numbered(table, np.arange(0.0, 70.0, 5.0), 5.0)
    assert numbers.tolist() == [1, 1, 1, 1, 0, 0, 0, 0, 0, 2, 2, 2, 2, 2]


@pytest.mark.long
@pytest.mark.parametrize(("profile", "more"), [("gles3", ""), ("gles3", LIT), ("gles2-2048", "")])
def test_no_picture_changes_and_textures_compress_better(tmp_path, profile, more) -> None:
    flat, plain = packages(tmp_path, profile, more)
    assert kept(flat)
    assert not kept(plain)
    pairs = list(zip(texels(flat), texels(plain), strict=True))
    assert any((one != other).any() for one, other in pairs)
    sizes = [sum(len(zlib.compress(np.ascontiguousarray(each[k]).tobytes())) for each in pairs) for k in (0, 1)]
    assert sizes[0] < sizes[1]
    for level in flat.manifest.levels:
        views = standard_views(flat.manifest.grid)
        pictures = []
        for package in (flat, plain):
            with ray_caster_of(package, level.index, "shell")(package, level=level.index, transfer="shell") as renderer:
                pictures.append(
                    [renderer.render(view.box_from_clip(flat.manifest.grid, 1.0), (24, 24)) for view in views.values()]
                )
        for one, other in zip(*pictures, strict=True):
            assert np.array_equal(one, other)


@pytest.mark.parametrize("kind", ["editable", "classified", "bricks", "mipmaps", "house"])
def test_voxels_keep_their_values_where_something_else_reads_them(tmp_path, kind) -> None:
    package = tmp_path / "p.volpkg"
    built(write_kind(tmp_path, kind), package)
    assert not kept(Package.open(package))
