"""Bricks draw what the whole level does: at their borders, with ghosts for wider filters, and without the empty."""

import numpy as np
import pytest
from fetch import Fetch, trilinear
from scene_builds import drawn
from tiny_packages import ES2, ES3, NORM16, function, tiny_package

from volprep.render.renderer import Renderer
from volprep.scene.scene import BrickSettings
from volprep.truth.camera import standard_views
from volprep_formats.package.level_texels import level_texels

SPACING = (2.5, 0.7, 1.1)
NOISE = function((0.0, (0.2, 0.5, 1.0), 0.0), (255.0, (1.0, 0.8, 0.3), 0.9))
BAND = function((90.0, (0.2, 0.5, 1.0), 0.0), (100.0, (1.0, 0.8, 0.3), 0.9), (150.0, (1.0, 1.0, 1.0), 0.0))
CASES = [((1, 1, 1), 4), ((1, 7, 5), 3), ((13, 11, 7), 1), ((13, 11, 7), 5), ((31, 1, 17), 8), ((9, 33, 17), 16)]


def rounding(package, driver):
    """As in test_fetch: float32 positions, and 8 bits of weight where a GPU filters."""
    (pool,) = [texture for texture in package.manifest.textures if texture.role == "volume"]
    limit = 3 * 8 * max(*pool.shape_zyx, 64) * 2.0**-24
    return limit if "llvmpipe" in driver.renderer else limit + 3 * 2.0**-9


def planes(extent_xyz, spacing_xyz, cells):
    """Two planes through the inside; for each axis the face and the plane on a border of bricks."""
    rng = np.random.default_rng(7)
    for _ in range(2):
        corner, right, up = rng.random((3, 3)) * extent_xyz
        yield corner, right - corner, up - corner
    for axis in range(3):
        first, second = np.delete(np.diag(extent_xyz), axis, axis=0)
        for place in (extent_xyz[axis], (cells + 0.5) * spacing_xyz[axis]):
            yield np.eye(3)[axis] * place, first, second


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(("shape", "size"), CASES, ids=str)
@pytest.mark.parametrize(("reach", "profile"), [(1, ES3), (3, ES3), (1, NORM16), (1, ES2), (3, ES2)])
def test_the_shader_samples_the_trilinear_field_across_bricks(tmp_path, shape, size, reach, profile):
    dtype = np.uint16 if profile is NORM16 else np.uint8
    codes = np.random.default_rng(3).integers(0, np.iinfo(dtype).max + 1, shape, dtype=dtype)
    bricks = BrickSettings(size=max(size, reach), reach=reach)
    package = tiny_package(tmp_path / "p", codes, NOISE, profile, spacing_mm_zyx=SPACING, bricks=bricks)
    np.testing.assert_array_equal(level_texels(package, 0), codes)
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    with Fetch(package) as fetch:
        for plane in planes(extent_xyz, SPACING[::-1], bricks.size):
            positions, found = fetch.plane(*plane)
            error = np.abs(found - trilinear(codes, SPACING, positions)).max()
            assert error <= rounding(package, fetch.driver)


@pytest.mark.parametrize("offset", [(1, 0, 0), (-1, 1, 0), (1, -1, 1), (-1, -1, -1)])
def test_a_filter_finds_its_neighbours_in_the_brick_of_its_position(tmp_path, offset):
    """A reach of 2: what linear samples a voxel away read, as differences and cubic filters do."""
    codes = np.random.default_rng(3).integers(0, 256, (13, 11, 7), dtype=np.uint8)
    package = tiny_package(tmp_path / "p", codes, NOISE, bricks=BrickSettings(size=3, reach=2), spacing_mm_zyx=SPACING)
    text = package.read_text(package.manifest.level_programs[0].fragment)
    shift = f"vec3({', '.join(f'{float(step)}' for step in offset)})"
    moved = text[: text.index("void main()")].replace("PITCH + inside +", f"PITCH + inside + {shift} +")
    assert shift in moved
    probe = moved + "void main() { picture = vec4(stored_value(position(v_near.xyz / v_near.w))); }\n"
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    steps_mm = np.array(offset) * SPACING[::-1]
    with Fetch(package, probe) as fetch:
        for plane in planes(extent_xyz, SPACING[::-1], 3):
            positions, found = fetch.plane(*plane)
            # The outer half voxel is clamped before the filter looks beside it.
            inside = np.clip(positions, np.array(SPACING[::-1]) / 2, extent_xyz - np.array(SPACING[::-1]) / 2)
            truth = trilinear(codes, SPACING, inside + steps_mm)
            assert np.abs(found - truth).max() <= rounding(package, fetch.driver)


@pytest.mark.parametrize("form", [{"mipmaps": True}, {"bricks": BrickSettings(size=3)}], ids=["mipmaps", "bricks"])
def test_labels_are_those_of_the_voxel_that_a_position_is_in(tmp_path, form):
    levels = [np.random.default_rng(3).integers(0, 9, shape, dtype=np.uint8) for shape in ((13, 11, 7), (7, 6, 4))]
    levels = levels if "mipmaps" in form else levels[0]
    package = tiny_package(tmp_path / "p", levels, NOISE, ES3, spacing_mm_zyx=SPACING, labels=True, **form)
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    with Fetch(package) as fetch:
        for level, codes in enumerate(levels if "mipmaps" in form else [levels]):
            spacing = package.manifest.levels[level].grid.spacing_mm_zyx
            for corner, right, up in [*planes(extent_xyz, SPACING[::-1], 3)][:2]:
                positions, found = fetch.plane(corner, right, up, level)
                at = positions[:, ::-1] / spacing
                # Where float32 may take the next voxel nothing is said.
                sure = (np.abs(at - np.rint(at)) > 1e-4).all(axis=1)
                z, y, x = np.clip(np.floor(at[sure]).astype(int), 0, np.array(codes.shape) - 1).T
                np.testing.assert_array_equal(np.rint(found[sure] * 255), codes[z, y, x])


def test_bricks_of_one_value_are_drawn_from_the_index(tmp_path):
    codes = np.full((13, 11, 7), 0x1234, np.uint16)
    codes[:3, :3, :3] = np.random.default_rng(3).integers(0, 65536, (3, 3, 3), dtype=np.uint16)
    package = tiny_package(tmp_path / "p", codes, NOISE, NORM16, spacing_mm_zyx=SPACING, bricks=BrickSettings(size=3))
    (pool,) = [texture for texture in package.manifest.textures if texture.role == "volume"]
    assert pool.bricks.stored == 1
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    with Fetch(package) as fetch:
        for plane in planes(extent_xyz, SPACING[::-1], 3):
            positions, found = fetch.plane(*plane)
            assert np.abs(found - trilinear(codes, SPACING, positions)).max() <= rounding(package, fetch.driver)


def blob(shape=(21, 18, 25)):
    """A ball in nothing, with a little noise: most bricks show nothing through BAND, some of them have one value."""
    z, y, x = (np.arange(n) - (n - 1) / 2 for n in shape)
    distance = np.sqrt(z[:, None, None] ** 2 + y[:, None] ** 2 + x**2)
    noise = np.random.default_rng(5).integers(0, 9, shape)
    return np.clip(160 - 18 * distance + np.where(distance < 9, noise, 0), 0, 255).astype(np.uint8)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("classification", ["lookup", "preintegrated", "palette"])
def test_pictures_are_those_of_the_whole_level(tmp_path, classification):
    levels = [blob(), blob((11, 9, 13))]
    wishes = {"spacing_mm_zyx": SPACING, "classification": classification, "skip": ("distance", 3)}
    whole = tiny_package(tmp_path / "whole", levels, BAND, ES3, **wishes)
    bricks = tiny_package(tmp_path / "bricks", levels, BAND, ES3, **wishes, bricks=BrickSettings(size=4))
    layout = next(texture.bricks for texture in bricks.manifest.textures if texture.bricks is not None)
    assert layout.stored < 0.5 * np.prod(layout.bricks_zyx)
    grid = whole.manifest.grid
    # Sums are divided by the distance of two values: in three pixels of all that magnifies the rounding of positions.
    steps = 3 if classification == "preintegrated" else 1
    for level in (0, 1):
        with Renderer(whole, level=level) as one, Renderer(bricks, level=level) as other:
            for camera in [*standard_views(grid, "perspective").values()][::2]:
                box_from_clip = camera.box_from_clip(grid, 1.0)
                expected = one.render(box_from_clip, (32, 32))
                assert expected[..., 3].max() > 0.3
                np.testing.assert_allclose(
                    other.render(box_from_clip, (32, 32)), expected, rtol=0, atol=(steps + 0.01) / 255
                )


def test_a_level_of_which_nothing_is_seen_is_one_brick_and_an_empty_picture(tmp_path):
    package = tiny_package(tmp_path / "p", blob() // 8, BAND, ES3, bricks=BrickSettings(size=4))
    layout = next(texture.bricks for texture in package.manifest.textures if texture.bricks is not None)
    assert layout.stored == 1
    assert drawn(package, "left", (16, 16)).max() == 0.0
