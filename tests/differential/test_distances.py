"""Distances of cells to the nearest occupied one, against SciPy."""

import numpy as np
import pytest
from scipy import ndimage
from volumes import THREADS

from volprep.kernels import _native

SHAPES = [(1, 1, 1), (1, 5, 9), (7, 3, 200), (21, 17, 33), (2, 3, 9000), (300, 2, 3), (3, 600, 2)]
DENSITIES = [0.0, 0.001, 0.03, 0.5, 1.0]


def cells(shape, density, seed=5):
    return (np.random.default_rng(seed).random(shape) < density).astype(np.uint8)


def chebyshev(occupied, threads=0):
    dst = np.empty(occupied.shape, np.uint8)
    _native.chebyshev_distance(occupied, dst, threads)
    return dst


@pytest.mark.parametrize("density", DENSITIES)
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_chebyshev_distance_is_scipys_up_to_255_on_any_number_of_threads(shape, density):
    occupied = cells(shape, density)
    empty = np.full(shape, 255)
    expected = ndimage.distance_transform_cdt(occupied == 0, "chessboard") if occupied.any() else empty
    for threads in THREADS:
        assert (chebyshev(occupied, threads) == np.minimum(expected, 255)).all()


def test_arrays_of_other_shapes_are_refused():
    occupied = cells((3, 4, 5), 0.5)
    with pytest.raises(ValueError, match="expected"):
        _native.chebyshev_distance(occupied, np.empty((3, 4, 6), np.uint8))
    with pytest.raises(ValueError, match="at least one voxel"):
        _native.chebyshev_distance(occupied[:0], occupied[:0].copy())
    with pytest.raises(TypeError):
        _native.chebyshev_distance(occupied.astype(bool), occupied.copy())
