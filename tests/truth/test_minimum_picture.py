"""The true picture of minimum intensity projection."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.truth.camera import standard_views
from volprep.truth.projection import projected_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid

SHAPE_HW = (24, 31)
RAMP = [(0.0, (0.1, 0.2, 0.4), 0.1), (90.0, (1.0, 0.5, 0.0), 0.5), (255.0, (1.0, 1.0, 1.0), 2.5)]


@pytest.fixture
def scan():
    return np.random.default_rng(2).integers(0, 256, (9, 14, 11)).astype(np.uint8)


@pytest.mark.parametrize("view", ["anterior", "anterior-left", "posterior-left"])
def test_it_is_the_maximum_of_the_inverted_scan_with_the_inverted_function(scan, view) -> None:
    grid = Grid.of(scan.shape, (1.5, 1.0, 0.7))
    matrix = standard_views(grid)[view].box_from_clip(grid, 1.3)
    inverted = function(*[(255.0 - value, *shown) for value, *shown in reversed(RAMP)])
    least = projected_picture("minimum", Volume(scan, grid), function(*RAMP), matrix, SHAPE_HW, reference_mm=2.0)
    most = projected_picture("maximum", Volume(255 - scan, grid), inverted, matrix, SHAPE_HW, reference_mm=2.0)
    assert least.rgba[..., 3].max() > 0.15
    assert np.ptp(least.rgba[..., 0]) > 0.01
    assert np.abs(least.rgba - most.rgba).max() < 1e-12
    assert max(least.bound.max(), most.bound.max()) < 1e-9


def test_along_an_axis_through_voxel_centres_it_is_their_least_value() -> None:
    scan = np.random.default_rng(3).integers(0, 256, (8, 6, 8)).astype(np.uint8)
    grid = Grid.of(scan.shape, (1.0, 1.0, 1.0))
    straight = np.diag([4.0, 4.0, 3.0, 1.0])
    straight[:3, 3] = (4.0, 4.0, 3.0)
    # Clip x is the volume's x, clip y its z, and rays run along y.
    matrix = straight.copy()
    matrix[:3] = straight[[0, 2, 1]]
    matrix[1] = [0, 0, 3.0, 3.0]
    matrix[2] = [0, 4.0, 0, 4.0]
    picture = projected_picture("minimum", Volume(scan, grid), function(*RAMP), matrix, (8, 8))
    table = function(*RAMP)
    extinction = np.interp(
        scan.min(axis=1)[::-1], [p.value for p in table.points], [p.extinction_per_mm for p in table.points]
    )
    np.testing.assert_allclose(picture.rgba[..., 3], 1.0 - np.exp(-extinction), atol=1e-12)


def test_a_reference_length_of_nothing_is_refused(scan) -> None:
    grid = Grid.of(scan.shape, (1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="reference_mm is 0"):
        projected_picture("minimum", Volume(scan, grid), function(*RAMP), np.eye(4), (1, 1), reference_mm=0.0)
