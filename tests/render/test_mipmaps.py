"""Levels as mipmaps of one texture: each is its level, between two they mix, pictures are those of separate ones."""

import numpy as np
import pytest
from fetch import Fetch, trilinear
from tiny_packages import ES3, NORM16, function, tiny_package

from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package

SPACING = (2.5, 0.7, 1.1)
FAINT = function((0.0, (0.2, 0.5, 1.0), 0.0), (255.0, (1.0, 0.8, 0.3), 0.9))
SHAPES = [(2, 2, 2), (1, 7, 5), (13, 11, 7), (31, 1, 17), (3, 64, 29)]


def pyramid(shape, dtype=np.uint8, levels=3):
    """Levels of noise that halve every axis and round up, unlike each other."""
    rng = np.random.default_rng(11)
    high = np.iinfo(dtype).max
    return [rng.integers(0, high + 1, [-(-n // 2**k) for n in shape], dtype=dtype) for k in range(levels)]


def spacing_of(package: Package, level: int) -> tuple[float, float, float]:
    return package.manifest.levels[level].grid.spacing_mm_zyx


def planes(package: Package):
    """Corner, right and up: two through the inside, and the three faces where the volume ends."""
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    rng = np.random.default_rng(7)
    for _ in range(2):
        corner, right, up = rng.random((3, 3)) * extent_xyz
        yield corner, right - corner, up - corner
    for axis in range(3):
        first, second = np.delete(np.diag(extent_xyz), axis, axis=0)
        yield np.eye(3)[axis] * extent_xyz, first, second


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(
    ("profile", "dtype", "texels"), [(ES3, np.uint8, 0.0), (ES3, np.uint16, 2.0**-12), (NORM16, np.uint16, 0.0)]
)
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_each_mipmap_is_the_trilinear_field_of_its_level(tmp_path, shape, profile, dtype, texels):
    levels = pyramid(shape, dtype, 2 if max(shape) < 4 else 3)
    package = tiny_package(tmp_path / "p", levels, FAINT, profile, spacing_mm_zyx=SPACING, mipmaps=True)
    with Fetch(package) as fetch:
        # Positions of n texels carry about eight roundings of n · 2^-24 on each of three axes.
        limit = texels + 3 * 8 * 64 * 2.0**-24
        for mipmap, codes in enumerate(levels):
            np.testing.assert_array_equal(level_texels(package, mipmap).shape, codes.shape)
            for plane in planes(package):
                positions, found = fetch.plane(*plane, mipmap)
                truth = trilinear(codes, spacing_of(package, mipmap), positions)
                error = np.abs(found - truth).max()
                assert error <= (limit if "llvmpipe" in fetch.driver.renderer else limit + 3 * 2.0**-9)


def test_between_two_mipmaps_both_are_mixed_without_a_jump(tmp_path):
    levels = pyramid((13, 11, 7))
    package = tiny_package(tmp_path / "p", levels, FAINT, ES3, spacing_mm_zyx=SPACING, mipmaps=True)
    with Fetch(package) as fetch:
        for plane in planes(package):
            at = [fetch.plane(*plane, mipmap)[1] for mipmap in (0.0, 1.0, 2.0)]
            for mipmap in (0.25, 0.5, 1.75):
                lower, share = int(mipmap), mipmap % 1
                _, found = fetch.plane(*plane, mipmap)
                # The share of a level has 8 bits in drivers.
                assert np.abs(found - (at[lower] + share * (at[lower + 1] - at[lower]))).max() <= 2.0**-8
            for mipmap in (1.0 - 2.0**-6, 1.0 + 2.0**-6):
                assert np.abs(fetch.plane(*plane, mipmap)[1] - at[1]).max() <= 2.0**-6 + 2.0**-8


@pytest.mark.parametrize("classification", ["lookup", "preintegrated"])
def test_pictures_of_mipmaps_are_those_of_separate_textures(tmp_path, classification):
    levels = pyramid((13, 11, 7))
    wishes = {"spacing_mm_zyx": SPACING, "classification": classification, "skip": ("distance", 2)}
    apart = tiny_package(tmp_path / "apart", levels, FAINT, ES3, **wishes)
    chained = tiny_package(tmp_path / "chained", levels, FAINT, ES3, **wishes, mipmaps=True)
    assert len({texture.file for texture in chained.manifest.textures if texture.role == "volume"}) == 1
    grid = apart.manifest.grid
    for level in range(3):
        with (
            Renderer(apart, level=level, target="rgba32f") as one,
            Renderer(chained, level=level, target="rgba32f") as other,
        ):
            for camera in [*standard_views(grid, "perspective").values()][::4]:
                box_from_clip = camera.box_from_clip(grid, 1.0)
                expected = one.render(box_from_clip, (24, 24))
                assert expected[..., 3].max() > 0.5
                np.testing.assert_allclose(other.render(box_from_clip, (24, 24)), expected, rtol=0, atol=2e-4)


def test_memory_is_that_of_all_mipmaps(tmp_path):
    package = tiny_package(tmp_path / "p", pyramid((16, 16, 16)), FAINT, ES3, mipmaps=True)
    tables = 256 * 8
    size = 16**3 + 8**3 + 4**3 + tables
    for limit, fits in ((size, True), (size - 1, False)):
        profile = ES3.model_copy(update={"max_texture_bytes": limit})
        limited = Package(package.path, package.manifest.model_copy(update={"profile": profile}))
        if fits:
            Renderer(limited, level=2)
            continue
        with pytest.raises(VolprepError, match=f"VP5014 .*{size}"):
            Renderer(limited, level=2)


def test_a_mipmap_that_the_file_does_not_hold_is_refused(tmp_path):
    package = tiny_package(tmp_path / "p", pyramid((16, 16, 16)), FAINT, ES3, mipmaps=True)
    textures = tuple(
        texture.model_copy(update={"mipmap": 4, "shape_zyx": (1, 1, 1)}) if texture.mipmap == 2 else texture
        for texture in package.manifest.textures
    )
    lying = Package(package.path, package.manifest.model_copy(update={"textures": textures}))
    with pytest.raises(VolprepError, match="VP5016"), Renderer(lying, level=2):
        pass
