"""How long rays are, and how many samples they take."""

import numpy as np
import pytest

from volprep.truth.camera import standard_views
from volprep.validation.timing.rays import chords_mm, samples
from volprep_formats.grid import Grid

TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
# Flipped along x, turned about z: the box must not care.
GRID = Grid.of((5, 7, 11), (2.5, 0.75, 1.0), (10.0, -20.0, 30.0), TURN @ np.diag([-1.0, 1.0, 1.0]))


def parallel(forward_box, extent_mm_xyz) -> np.ndarray:
    """Clip coordinates over a square of 40 mm around the box's middle, looking along an axis of the box."""
    axis = int(np.argmax(np.abs(forward_box)))
    across, up = ((axis + 1) % 3, (axis + 2) % 3)
    matrix = np.eye(4)
    matrix[:3, :3] = 0.0
    matrix[across, 0] = matrix[up, 1] = 20.0
    matrix[axis, 2] = 100.0 * forward_box[axis]
    matrix[:3, 3] = np.array(extent_mm_xyz) / 2
    return matrix


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_ray_along_an_axis_is_as_long_as_the_box_or_misses_it(axis, sign) -> None:
    extent = np.array(GRID.extent_mm_zyx[::-1])
    matrix = parallel(np.eye(3)[axis] * sign, extent)
    chords = chords_mm(matrix, (81, 80), GRID)
    assert set(np.unique(chords.round(9))) == {0.0, round(extent[axis], 9)}
    # The share of rays that hit is the share of the square that the box covers, up to a row and a column.
    area = np.prod(np.delete(extent, axis))
    assert np.count_nonzero(chords) * (40.0 / 80) * (40.0 / 81) == pytest.approx(area, rel=0.15)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_rays_of_a_picture_measure_the_volume_of_the_box(projection) -> None:
    camera = standard_views(GRID, projection)["anterior-left"]
    matrix = camera.box_from_clip(GRID, 1.0)
    chords = chords_mm(matrix, (200, 200), GRID)
    assert chords.max() <= np.linalg.norm(GRID.extent_mm_zyx)
    if projection == "orthographic":
        pixel_mm2 = (camera.height_mm / 200) ** 2
        assert chords.sum() * pixel_mm2 == pytest.approx(np.prod(GRID.extent_mm_zyx), rel=2e-3)


def test_a_ray_within_a_face_counts_as_a_miss_without_a_warning() -> None:
    matrix = parallel(np.array([0.0, 0.0, 1.0]), np.array([0.0, GRID.extent_mm_zyx[1], GRID.extent_mm_zyx[0]]))
    assert chords_mm(matrix, (1, 1), GRID)[0, 0] == 0.0


def test_segments_are_equal_and_none_is_longer_than_the_step() -> None:
    np.testing.assert_array_equal(samples(np.array([0.0, 0.1, 1.0, 1.01, 2.5]), 0.5), [0, 1, 2, 3, 5])
