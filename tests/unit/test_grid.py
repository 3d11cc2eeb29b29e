import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from volprep_formats.grid import Grid

SHAPES = st.tuples(*[st.integers(1, 40)] * 3)
SPACINGS = st.tuples(*[st.floats(0.01, 100.0)] * 3)
FACTORS = st.tuples(*[st.sampled_from([1, 2, 3, 4, 8])] * 3)


def rotation(angle_x: float, angle_z: float) -> np.ndarray:
    cx, sx, cz, sz = np.cos(angle_x), np.sin(angle_x), np.cos(angle_z), np.sin(angle_z)
    return np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]) @ np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])


def oblique(shape_zyx=(5, 6, 7), spacing_mm_zyx=(2.0, 1.0, 0.5)) -> Grid:
    return Grid.of(shape_zyx, spacing_mm_zyx, (10.0, -20.0, 30.0), rotation(0.3, -1.1))


def test_voxel_zero_lies_at_the_origin_and_axes_are_in_xyz_order() -> None:
    grid = Grid.of((5, 6, 7), (2.0, 1.0, 0.5), (10.0, -20.0, 30.0))
    assert np.array_equal(grid.world_from_index @ [0, 0, 0, 1], [10.0, -20.0, 30.0, 1.0])
    assert np.array_equal(grid.world_from_index @ [1, 2, 3, 1], [10.5, -18.0, 36.0, 1.0])


def test_box_space_begins_half_a_voxel_before_the_first_centre() -> None:
    grid = oblique()
    centre_of_voxel_zero = grid.world_from_box @ [0.25, 0.5, 1.0, 1.0]
    np.testing.assert_allclose(centre_of_voxel_zero[:3], grid.origin_mm_xyz, atol=1e-12)


def test_an_odd_axis_rounds_up_and_keeps_the_true_extent() -> None:
    coarse = oblique(shape_zyx=(5, 6, 7)).coarser((2, 2, 2))
    assert coarse.shape_zyx == (3, 3, 4)
    assert coarse.spacing_mm_zyx == (4.0, 2.0, 1.0)
    assert coarse.extent_mm_zyx == (10.0, 6.0, 3.5)


@given(SHAPES, SPACINGS, FACTORS)
def test_every_level_has_the_same_corner(shape_zyx, spacing_mm_zyx, factors_zyx) -> None:
    grid = oblique(shape_zyx, spacing_mm_zyx)
    coarse = grid.coarser(factors_zyx)
    scale = max(spacing_mm_zyx) * max(factors_zyx)
    np.testing.assert_allclose(coarse.corner_mm_xyz, grid.corner_mm_xyz, atol=1e-12 * (scale + 50))


@given(SHAPES, SPACINGS, FACTORS)
def test_a_coarse_voxel_lies_in_the_middle_of_the_voxels_that_it_replaces(
    shape_zyx, spacing_mm_zyx, factors_zyx
) -> None:
    grid = oblique(shape_zyx, spacing_mm_zyx)
    middle_xyz = [(f - 1) / 2 for f in factors_zyx[::-1]]
    expected = grid.world_from_index @ [*middle_xyz, 1.0]
    found = grid.coarser(factors_zyx).world_from_index @ [0, 0, 0, 1]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        {"shape_zyx": (0, 1, 1)},
        {"spacing_mm_zyx": (1.0, -1.0, 1.0)},
        {"spacing_mm_zyx": (1.0, float("nan"), 1.0)},
        {"origin_mm_xyz": (float("inf"), 0.0, 0.0)},
        {"direction": ((1.0, 0.1, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))},
    ],
)
def test_a_grid_that_is_no_grid_is_refused(change) -> None:
    with pytest.raises(ValidationError):
        Grid.model_validate(oblique().model_dump() | change)
