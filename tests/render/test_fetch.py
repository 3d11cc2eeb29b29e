"""What the shaders sample, against the trilinear field in float64."""

import numpy as np
import pytest
from fetch import Fetch, away_from_faces, nearest, trilinear
from tiny_packages import ES2, ES3, NORM16, function, tiny_package

from volprep.parts.mosaic.packing import Packing

SHAPES = [(1, 1, 1), (1, 7, 5), (2, 3, 1), (3, 1, 13), (5, 4, 4), (13, 11, 7), (31, 17, 5), (192, 5, 3), (64, 29, 23)]
SPACING = (2.5, 0.7, 1.1)
LAYOUTS = [(ES3, 1), (ES2, 1), (ES2, 4)]
NOTHING = function((0.0, (1.0, 1.0, 1.0), 1.0))

layouts = pytest.mark.parametrize(("profile", "channels"), LAYOUTS, ids=["texture3d", "mosaic-scan-1", "mosaic-scan-4"])


def tolerance(package, driver):
    """Largest error of a stored value, 0 to 1, that float32 positions and the driver's filter explain.

    A position of n texels carries about eight roundings of n · 2^-24 texels, on each of three axes, and between two
    texels the field changes by 1 at most. A GPU filters with 8 bits of weight on each axis that it filters itself.
    """
    (volume,) = [texture for texture in package.manifest.textures if texture.role == "volume"]
    depth = package.manifest.levels[0].grid.shape_zyx[0]
    rounding = 3 * 8 * max(*volume.shape_zyx, depth) * 2.0**-24
    filtered_axes = 3 if volume.mosaic is None else 2
    return rounding if "llvmpipe" in driver.renderer else rounding + filtered_axes * 2.0**-9


def planes(extent_xyz):
    """Corner, right and up of planes: four through the inside, and all six faces."""
    rng = np.random.default_rng(7)
    for _ in range(4):
        corner, right, up = rng.random((3, 3)) * extent_xyz
        yield corner, right - corner, up - corner
    for axis in range(3):
        first, second = np.delete(np.diag(extent_xyz), axis, axis=0)
        yield np.zeros(3), first, second
        yield np.eye(3)[axis] * extent_xyz, first, second


@pytest.mark.long(keep=5)
@layouts
@pytest.mark.parametrize("shape_zyx", SHAPES, ids=str)
def test_the_shader_samples_the_trilinear_field_up_to_the_borders(tmp_path, profile, channels, shape_zyx):
    codes = np.random.default_rng(3).integers(0, 256, shape_zyx, dtype=np.uint8)
    package = tiny_package(
        tmp_path / "p", codes, NOTHING, profile, spacing_mm_zyx=SPACING, packing=Packing(channels), step_mm=1.0
    )
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    with Fetch(package) as fetch:
        for plane in planes(extent_xyz):
            positions, found = fetch.plane(*plane)
            error = np.abs(found - trilinear(codes, SPACING, positions)).max()
            assert error <= tolerance(package, fetch.driver)


@pytest.mark.long(keep=5)
@layouts
@pytest.mark.parametrize("shape_zyx", SHAPES, ids=str)
def test_of_labels_the_shader_samples_the_voxel_that_a_position_is_in(tmp_path, profile, channels, shape_zyx):
    codes = np.random.default_rng(9).integers(0, 256, shape_zyx, dtype=np.uint8)
    packing = Packing(channels)
    package = tiny_package(
        tmp_path / "p", codes, NOTHING, profile, spacing_mm_zyx=SPACING, packing=packing, step_mm=1.0, labels=True
    )
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    compared = 0
    with Fetch(package) as fetch:
        for plane in planes(extent_xyz):
            positions, found = fetch.plane(*plane)
            sure = away_from_faces(shape_zyx, SPACING, positions)
            compared += int(sure.sum())
            expected = nearest(codes, SPACING, positions)
            np.testing.assert_array_equal(np.rint(found[sure] * 255), np.rint(expected[sure] * 255))
    assert compared > 8000


@layouts
def test_at_voxel_centres_the_shader_finds_the_code_itself(tmp_path, profile, channels):
    codes = np.random.default_rng(4).integers(0, 256, (9, 48, 48), dtype=np.uint8)
    package = tiny_package(tmp_path / "p", codes, NOTHING, profile, packing=Packing(channels))
    with Fetch(package) as fetch:
        for k in range(9):
            _, found = fetch.plane(
                np.array([0.0, 0.0, k + 0.5]), np.array([48.0, 0.0, 0.0]), np.array([0.0, 48.0, 0.0])
            )
            # The plane's rows run from the top down.
            np.testing.assert_array_equal(np.rint(found * 255).reshape(48, 48)[::-1], codes[k])


def test_16_bit_codes_are_sampled_with_the_precision_of_half_floats(tmp_path):
    codes = np.random.default_rng(5).integers(0, 65536, (6, 7, 5), dtype=np.uint16)
    package = tiny_package(tmp_path / "p", codes, NOTHING, ES3, spacing_mm_zyx=SPACING, step_mm=1.0)
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    with Fetch(package) as fetch:
        for plane in planes(extent_xyz):
            positions, found = fetch.plane(*plane)
            error = np.abs(found - trilinear(codes, SPACING, positions)).max()
            assert error <= 2.0**-12 + tolerance(package, fetch.driver)


def test_16_bit_texels_of_a_profile_that_has_them_are_sampled_exactly(tmp_path):
    codes = np.random.default_rng(5).integers(0, 65536, (6, 7, 5), dtype=np.uint16)
    package = tiny_package(tmp_path / "p", codes, NOTHING, NORM16, spacing_mm_zyx=SPACING, step_mm=1.0)
    (volume,) = [texture for texture in package.manifest.textures if texture.role == "volume"]
    assert volume.format == "r16unorm"
    extent_xyz = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    with Fetch(package) as fetch:
        for plane in planes(extent_xyz):
            positions, found = fetch.plane(*plane)
            assert np.abs(found - trilinear(codes, SPACING, positions)).max() <= tolerance(package, fetch.driver)


PRINTED = """
const float numberOfSlices = 192.0;
const float slicesOverX = 16.0;
const float slicesOverY = 12.0;
float stored_value(vec3 at) {
  vec3 volpos = at / vec3(PITCH, numberOfSlices);
  float s1 = floor(volpos.z * numberOfSlices);
  float s2 = s1 + 1.0;
  float dx1 = fract(s1 / slicesOverX);
  float dy1 = floor(s1 / slicesOverY) / slicesOverY;
  float dx2 = fract(s2 / slicesOverX);
  float dy2 = floor(s2 / slicesOverY) / slicesOverY;
  vec2 tp1 = vec2(dx1 + volpos.x / slicesOverX, dy1 + volpos.y / slicesOverY);
  vec2 tp2 = vec2(dx2 + volpos.x / slicesOverX, dy2 + volpos.y / slicesOverY);
  return mix(texture2D(u_volume, tp1).x, texture2D(u_volume, tp2).x, volpos.z * numberOfSlices - s1);
}
void main() { gl_FragColor = vec4(stored_value(position(v_near.xyz / v_near.w))); }
"""


def test_the_published_fetch_fails_on_a_grid_of_16_by_12_where_ours_holds(tmp_path):
    """Congote et al.'s listing, as the mobile volume rendering thesis prints it, takes rows for columns."""
    codes = np.random.default_rng(6).integers(0, 256, (192, 5, 3), dtype=np.uint8)
    package = tiny_package(tmp_path / "p", codes, NOTHING, ES2)
    layout = package.manifest.textures[-1].mosaic
    assert layout is not None
    assert (layout.tiles_x, layout.tiles_y) == (16, 12)
    text = package.read_text(package.manifest.level_programs[0].fragment)
    # Through the middle of the tiles, so that what is wrong in the plane does not count.
    plane = (np.array([1.5, 2.5, 0.0]), np.array([0.0, 0.0, 192.0]), np.array([1e-3, 0.0, 0.0]))
    with Fetch(package, text[: text.index("vec4 tile_texel")] + PRINTED) as fetch:
        positions, printed = fetch.plane(*plane)
    with Fetch(package) as fetch:
        _, ours = fetch.plane(*plane)
        limit = tolerance(package, fetch.driver)
    truth = trilinear(codes, (1.0, 1.0, 1.0), positions)
    assert np.mean(np.abs(printed - truth) > 1 / 255) > 0.87
    assert np.abs(ours - truth).max() <= limit
