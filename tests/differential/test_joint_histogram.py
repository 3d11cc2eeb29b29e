"""The joint histogram of a level against a twin that interpolates the whole level, and what must hold."""

import numpy as np
import pytest
from volumes import THREADS

from volprep.kernels import _native


def counted(src, level, factors, threads=0):
    counts = np.zeros((256, 256), np.uint64)
    _native.joint_histogram(src, 0, len(src), level, 0, factors, counts, threads)
    return counts


def along(values, axis, voxels, factor):
    """Values at the centres of voxels, linear between those of a level, clamped beyond the outer ones."""
    length = values.shape[axis]
    at = np.clip((np.arange(voxels) + 0.5) / factor - 0.5, 0, length - 1)
    lower = np.floor(at).astype(int)
    share = np.expand_dims(at - lower, [k for k in range(3) if k != axis])
    upper = np.minimum(lower + 1, length - 1)
    return np.take(values, lower, axis) * (1 - share) + np.take(values, upper, axis) * share


def twin(src, level, factors):
    values = level.astype(np.float64)
    for axis, (voxels, factor) in enumerate(zip(src.shape, factors, strict=True)):
        values = along(values, axis, voxels, factor)
    scale = 255 / np.iinfo(src.dtype).max
    counts = np.zeros((256, 256), np.uint64)
    np.add.at(counts, tuple(np.floor(each * scale + 0.5).astype(int) for each in (values, src.astype(float))), 1)
    return counts


def volume(shape, dtype):
    src = np.random.default_rng(5).integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    src[: len(src) // 2] = np.iinfo(dtype).max
    return src


@pytest.mark.parametrize("shape", [(7, 9, 11), (1, 5, 8), (4, 1, 1), (1, 1, 1)], ids=str)
@pytest.mark.parametrize("factors", [(2, 2, 2), (1, 2, 4), (4, 4, 1), (1, 1, 1)], ids=str)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_counts_are_those_of_the_twin_on_any_number_of_threads(dtype, factors, shape):
    src = volume(shape, dtype)
    level = np.empty(_native.box_reduced_shape(shape, factors), dtype)
    _native.box_reduce(src, level, factors)
    expected = twin(src, level, factors)
    assert expected.sum() == src.size
    for threads in THREADS:
        assert np.array_equal(counted(src, level, factors, threads), expected)


@pytest.mark.parametrize("factors", [(2, 2, 2), (4, 1, 2)], ids=str)
def test_slabs_add_up_to_the_whole(factors):
    src = volume((19, 6, 7), np.uint8)
    level = np.empty(_native.box_reduced_shape(src.shape, factors), np.uint8)
    _native.box_reduce(src, level, factors)
    counts = np.zeros((256, 256), np.uint64)
    for first, stop in ((0, 4), (4, 5), (5, 19)):
        low = max(0, first // factors[0] - 1)
        high = min(len(level), (stop - 1) // factors[0] + 2)
        _native.joint_histogram(src[first:stop], first, 19, level[low:high], low, factors, counts)
    assert np.array_equal(counts, counted(src, level, factors))


def test_slices_that_are_missing_are_a_value_error():
    src = np.zeros((8, 4, 4), np.uint8)
    level = np.zeros((4, 2, 2), np.uint8)
    counts = np.zeros((256, 256), np.uint64)
    for held, first in ((level[1:], 1), (level[:3], 0), (level, 1), (level[:, :1].copy(), 0)):
        with pytest.raises(ValueError, match="level"):
            _native.joint_histogram(src, 0, 8, held, first, (2, 2, 2), counts)
    with pytest.raises(ValueError, match="depth"):
        _native.joint_histogram(src, 1, 8, level, 0, (2, 2, 2), counts)
    with pytest.raises(TypeError, match="level"):
        _native.joint_histogram(src, 0, 8, level.astype(np.uint16), 0, (2, 2, 2), counts)
