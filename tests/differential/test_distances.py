"""Distances of cells to the nearest occupied one, against SciPy and against a search through every cube."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage
from volumes import THREADS

from volprep.kernels import _native

FAR_AWAY = 65535
SHAPES = [(1, 1, 1), (1, 5, 9), (7, 3, 200), (21, 17, 33), (2, 3, 9000), (300, 2, 3), (3, 600, 2)]
DENSITIES = [0.0, 0.001, 0.03, 0.5, 1.0]


def cells(shape, density, seed=5):
    return (np.random.default_rng(seed).random(shape) < density).astype(np.uint8)


def chebyshev(occupied, threads=0):
    dst = np.empty(occupied.shape, np.uint8)
    _native.chebyshev_distance(occupied, dst, threads)
    return dst


def octants(occupied, threads=0):
    z, y, x = occupied.shape
    dst = np.empty((8 * z, y, x), np.uint8)
    _native.octant_distance(occupied, dst, threads)
    return dst.reshape(8, z, y, x)


def euclidean(occupied, threads=0):
    dst = np.empty(occupied.shape, np.uint16)
    _native.euclidean_distance(occupied, dst, threads)
    return dst


@pytest.mark.parametrize("density", DENSITIES)
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_chebyshev_distance_is_scipys_up_to_255_on_any_number_of_threads(shape, density):
    occupied = cells(shape, density)
    empty = np.full(shape, 255)
    expected = ndimage.distance_transform_cdt(occupied == 0, "chessboard") if occupied.any() else empty
    for threads in THREADS:
        assert (chebyshev(occupied, threads) == np.minimum(expected, 255)).all()


@pytest.mark.parametrize("density", DENSITIES)
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_squared_euclidean_distance_is_scipys_below_255_cells_on_any_number_of_threads(shape, density):
    occupied = cells(shape, density)
    expected = np.full(shape, FAR_AWAY)
    if occupied.any():
        squares = np.rint(ndimage.distance_transform_edt(occupied == 0) ** 2)
        expected = np.where(squares < 255**2, squares, FAR_AWAY)
    for threads in THREADS:
        assert (euclidean(occupied, threads) == expected).all()


def test_squared_euclidean_distance_is_scipys_far_from_what_is_occupied_and_beside_it():
    z, y, x = np.ogrid[:90, :150, :170]
    ball = (z - 20) ** 2 + (y - 30) ** 2 + (x - 90) ** 2 < 15**2
    occupied = (ball | ((y == 140) & (x > 60 + z // 2))).astype(np.uint8)
    expected = np.rint(ndimage.distance_transform_edt(occupied == 0) ** 2)
    assert expected.max() > 75**2
    assert (euclidean(occupied) == expected).all()


@given(st.tuples(*[st.integers(1, 6)] * 3), st.sampled_from([0.02, 0.2, 0.7]), st.integers(0, 2**32 - 1))
def test_octants_hold_the_largest_empty_cube_ahead(shape, density, seed):
    occupied = cells(shape, density, seed)
    found = octants(occupied, 1)
    for octant, index in np.ndindex(8, occupied.size):
        at = np.unravel_index(index, shape)
        edge = 0
        while edge < 255:
            ahead = []
            for bit, axis in ((4, 0), (2, 1), (1, 2)):
                first, last = (at[axis] - edge, at[axis]) if octant & bit else (at[axis], at[axis] + edge)
                ahead.append(slice(max(first, 0), last + 1))
            # Nothing outside is occupied: once the cube covers all that is ahead, it can grow for ever.
            if occupied[tuple(ahead)].any():
                break
            edge = edge + 1 if edge <= max(shape) else 255
        assert found[octant][at] == edge


def test_octants_never_see_less_than_all_directions_together():
    occupied = cells((13, 17, 19), 0.01)
    assert (octants(occupied) >= chebyshev(occupied)).all()


def test_arrays_of_other_shapes_are_refused():
    occupied = cells((3, 4, 5), 0.5)
    for function, shape, dtype in (
        (_native.chebyshev_distance, (3, 4, 6), np.uint8),
        (_native.octant_distance, (3, 4, 5), np.uint8),
        (_native.euclidean_distance, (3, 5, 5), np.uint16),
    ):
        with pytest.raises(ValueError, match="expected"):
            function(occupied, np.empty(shape, dtype))
    with pytest.raises(ValueError, match="at least one voxel"):
        _native.chebyshev_distance(occupied[:0], occupied[:0].copy())
    with pytest.raises(TypeError):
        _native.chebyshev_distance(occupied.astype(bool), occupied.copy())
