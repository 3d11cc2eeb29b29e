"""slice_ranges against a twin that looks at every row and column by itself."""

import math

import numpy as np
import pytest
from hypothesis import given
from volumes import THREADS, VOXEL_TYPES, same_bytes, volumes

from volprep.kernels import _native


def ranges(src, threads=0):
    depth, height, width = src.shape
    found = [np.empty((depth, n), src.dtype) for n in (height, height, width, width)]
    _native.slice_ranges(src, *found, threads)
    return found


def order(voxel):
    """-NaN < -inf < ... < -0 < +0 < ... < +inf < +NaN."""
    sign = math.copysign(1, voxel)
    return (sign * 2, 0) if math.isnan(voxel) else (sign if math.isinf(voxel) else 0, voxel, sign)


def twin(src):
    rows = [[min(row, key=order) for row in plane] for plane in src], [[max(row, key=order) for row in p] for p in src]
    turned = src.transpose(0, 2, 1)
    columns = [[min(c, key=order) for c in p] for p in turned], [[max(c, key=order) for c in p] for p in turned]
    return [np.array(table, src.dtype).reshape(len(src), -1) for table in (*rows, *columns)]


@given(volumes())
def test_ranges_are_those_of_the_twin_bit_by_bit_on_any_number_of_threads(src):
    expected = twin(src)
    for threads in THREADS:
        assert all(same_bytes(a, e) for a, e in zip(ranges(src, threads), expected, strict=True))


@pytest.mark.parametrize("dtype", VOXEL_TYPES, ids=str)
@pytest.mark.parametrize("width", [1023, 1024, 1025, 2500])
def test_rows_longer_than_a_tile_are_like_the_twin(dtype, width):
    src = np.random.default_rng(3).integers(0, 256, (2, 3, width)).astype(dtype)
    assert all(same_bytes(a, e) for a, e in zip(ranges(src), twin(src), strict=True))


@pytest.mark.parametrize("bad", [np.nan, -np.nan, np.inf, -np.inf])
def test_a_voxel_that_is_not_finite_shows_in_its_row_and_its_column(bad):
    src = np.zeros((2, 3, 5), np.float32)
    src[1, 2, 3] = bad
    row_low, row_high, column_low, column_high = ranges(src)
    rows, columns = np.isfinite(row_low) & np.isfinite(row_high), np.isfinite(column_low) & np.isfinite(column_high)
    assert np.argwhere(~rows).tolist() == [[1, 2]]
    assert np.argwhere(~columns).tolist() == [[1, 3]]


@pytest.mark.parametrize("table", range(4))
def test_tables_of_another_shape_or_type_are_refused(table):
    src = np.zeros((2, 3, 5), np.int16)
    good = [np.empty((2, n), np.int16) for n in (3, 3, 5, 5)]
    for wrong, error in ((np.empty((2, 4), np.int16), ValueError), (good[table].astype(np.uint16), TypeError)):
        with pytest.raises(error):
            _native.slice_ranges(src, *(wrong if k == table else each for k, each in enumerate(good)))


def test_an_empty_volume_is_refused():
    with pytest.raises(ValueError, match="at least one voxel"):
        _native.slice_ranges(np.empty((0, 1, 1), np.uint8), *(np.empty((0, 1), np.uint8) for _ in range(4)))
