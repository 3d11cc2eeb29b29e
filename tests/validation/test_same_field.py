"""Where a level is the scan itself, its picture is the truth; where a few voxels differ, only their rays are drawn."""

from dataclasses import replace

import numpy as np
import pytest
from tiny_packages import function

from volprep.truth.camera import standard_views
from volprep.truth.lit import Lit, ShaderSlopes
from volprep.truth.volume import Volume
from volprep.validation.subjects.same_field import (
    camera_of_every,
    camera_of_pixels,
    changed_voxels,
    part_of,
    pixels_around,
)
from volprep_formats.grid import Grid
from volprep_formats.package.program import Light

GRID = Grid(
    shape_zyx=(5, 6, 7),
    spacing_mm_zyx=(3.0, 1.0, 0.5),
    extent_mm_zyx=(15.0, 6.0, 3.5),
    origin_mm_xyz=(4.0, -2.0, 1.0),
    direction=((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
)
FUNCTION = function((10.0, (1.0, 1.0, 1.0), 0.0), (20.0, (1.0, 1.0, 1.0), 1.0), name="walls")


@pytest.fixture
def scan() -> Volume:
    stored = np.random.default_rng(7).integers(0, 250, GRID.shape_zyx).astype(np.int16)
    stored[:, 0], stored[:, 1], stored[:, -1] = 3, 3, 3
    return Volume(stored, GRID, 2.0, -1.0)


def held(scan: Volume, rows: slice) -> Volume:
    """Return the codes of some rows of the scan."""
    start = np.array(GRID.origin_mm_xyz) + np.array(GRID.direction) @ [0.0, rows.start * 1.0, 0.0]
    grid = GRID.model_copy(update={"origin_mm_xyz": tuple(start.tolist()), "shape_zyx": (5, rows.stop - rows.start, 7)})
    return Volume(np.ascontiguousarray(scan.stored[:, rows]).astype(np.uint8), grid, 2.0, -1.0)


def test_codes_of_all_that_a_scan_shows_are_the_scan(scan: Volume) -> None:
    level = held(scan, slice(1, 6))
    assert part_of(scan.grid, level.grid) == (slice(0, 5), slice(1, 6), slice(0, 7))
    changed = changed_voxels(scan, level, FUNCTION)
    assert changed is not None
    assert changed.shape == (0, 3)


def test_a_voxel_with_another_value_is_found(scan: Volume) -> None:
    level = held(scan, slice(1, 6))
    level.stored[2, 3, 4] += 1
    changed = changed_voxels(scan, level, FUNCTION)
    assert changed is not None
    assert changed.tolist() == [[2, 3, 4]]


@pytest.mark.parametrize("rows", [slice(2, 6), slice(1, 5)])
def test_codes_beside_which_the_scan_shows_something_are_not_the_scan(scan: Volume, rows: slice) -> None:
    assert changed_voxels(scan, held(scan, rows), FUNCTION) is None


def test_codes_of_another_slope_are_not_the_scan(scan: Volume) -> None:
    assert changed_voxels(scan, replace(held(scan, slice(1, 6)), slope=2.1), FUNCTION) is None


@pytest.mark.long
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_pixels_around_a_voxel_are_those_whose_rays_meet_its_cells(projection: str) -> None:
    shape_hw = (40, 30)
    for camera in standard_views(GRID, projection).values():
        matrix = camera.box_from_clip(GRID, aspect=0.75)
        rows, columns = pixels_around(np.array([2, 3, 4]), GRID, matrix, shape_hw)
        for row, column in np.ndindex(shape_hw):
            x, y = (2 * column + 1) / 30 - 1, 1 - (2 * row + 1) / 40
            ends = [matrix @ [x, y, depth, 1.0] for depth in (-1.0, 1.0)]
            near, far = (end[:3] / end[3] for end in ends)
            along = near + np.linspace(0, 1, 2000)[:, None] * (far - near)
            index_xyz = along / np.array([0.5, 1.0, 3.0]) - 0.5
            if (np.abs(index_xyz - [4, 3, 2]) < 1).all(axis=1).any():
                assert rows.start <= row < rows.stop
                assert columns.start <= column < columns.stop


def test_the_camera_of_some_pixels_has_their_rays() -> None:
    matrix = standard_views(GRID, "perspective")["anterior-left"].box_from_clip(GRID, aspect=0.75)
    part = camera_of_pixels(matrix, (40, 30), slice(10, 16), slice(3, 8))
    whole = matrix @ [(2 * 7 + 1) / 30 - 1, 1 - (2 * 12 + 1) / 40, 0.3, 1.0]
    np.testing.assert_allclose(part @ [(2 * 4 + 1) / 5 - 1, 1 - (2 * 2 + 1) / 6, 0.3, 1.0], whole, rtol=1e-12)


def test_the_camera_of_every_second_pixel_has_their_rays() -> None:
    matrix = standard_views(GRID, "perspective")["anterior-left"].box_from_clip(GRID, aspect=0.75)
    sparse = camera_of_every(matrix, (40, 31), 2)
    whole = matrix @ [(2 * 14 + 1) / 31 - 1, 1 - (2 * 12 + 1) / 40, 0.3, 1.0]
    np.testing.assert_allclose(sparse @ [(2 * 7 + 1) / 16 - 1, 1 - (2 * 6 + 1) / 20, 0.3, 1.0], whole, rtol=1e-12)


HEADLIGHT = Lit(ShaderSlopes("central", 0.1))


def lit(volume: Volume, light: Lit = HEADLIGHT) -> Volume:
    """Return the volume, lit by differences of its values."""
    return replace(volume, normals=light)


def test_light_on_differences_of_the_same_values_is_the_same(scan: Volume) -> None:
    scan.stored[:, 2] = 3
    changed = changed_voxels(lit(scan), lit(held(scan, slice(1, 6))), FUNCTION)
    assert changed is not None
    assert changed.shape == (0, 3)


def test_a_border_of_one_voxel_is_not_enough_for_light(scan: Volume) -> None:
    """Differences at the outermost voxels of the codes are not those of the scan."""
    assert changed_voxels(lit(scan), lit(held(scan, slice(1, 6))), FUNCTION) is None


@pytest.mark.parametrize(
    "light",
    [
        "central",
        Lit(ShaderSlopes("forward", 0.1)),
        Lit(ShaderSlopes("central", 0.1), Light(place_mm_xyz=(0.0, 0.0, 0.0), shadows="map")),
    ],
)
def test_light_that_may_differ_leaves_no_voxel_the_same(scan: Volume, light: Lit) -> None:
    scan.stored[:, 2] = 3
    assert changed_voxels(replace(scan, normals=light), lit(held(scan, slice(1, 6))), FUNCTION) is None


def test_a_voxel_changes_light_one_voxel_further_than_values() -> None:
    matrix = standard_views(GRID, "orthographic")["anterior"].box_from_clip(GRID, aspect=1.0)
    near, far = (pixels_around(np.array([2, 3, 4]), GRID, matrix, (400, 400), reach) for reach in (0, 1))
    for one, other in zip(near, far, strict=True):
        assert other.start < one.start < one.stop < other.stop
