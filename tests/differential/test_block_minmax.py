"""block_minmax against a twin that cuts out every block, and against the field that blocks answer for."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from volumes import THREADS, VOXEL_TYPES, same_bytes, shapes, volumes

from volprep.kernels import _native


def minmax(src, block, threads=0):
    shape = _native.block_minmax_shape(src.shape, block)
    low, high = np.empty(shape, src.dtype), np.empty(shape, src.dtype)
    _native.block_minmax(src, block, low, high, threads)
    return low, high


def twin(src, block):
    shape = tuple(max(1, math.ceil((n - 1) / block)) for n in src.shape)
    low, high = np.empty(shape, src.dtype), np.empty(shape, src.dtype)
    for index in np.ndindex(shape):
        own = tuple(slice(b * block, min((b + 1) * block, n - 1) + 1) for b, n in zip(index, src.shape, strict=True))
        voxels = src[own].ravel().tolist()
        if any(math.isnan(voxel) for voxel in voxels):
            low[index], high[index] = -np.inf, np.inf
        else:  # -0 is less than +0
            low[index] = min(voxels, key=lambda voxel: (voxel, math.copysign(1, voxel)))
            high[index] = max(voxels, key=lambda voxel: (voxel, math.copysign(1, voxel)))
    return low, high


@given(volumes(), st.integers(1, 21))
def test_extremes_are_those_of_the_twin_bit_by_bit_on_any_number_of_threads(src, block):
    expected_low, expected_high = twin(src, block)
    for threads in THREADS:
        low, high = minmax(src, block, threads)
        assert same_bytes(low, expected_low)
        assert same_bytes(high, expected_high)


@pytest.mark.parametrize("dtype", VOXEL_TYPES, ids=str)
@pytest.mark.parametrize(
    ("shape", "block"),
    [((3, 4, 2501), 3), ((2, 2, 4100), 1024), ((2, 3, 1026), 1), ((40, 35, 33), 16), ((17, 1, 18), 16)],
    ids=str,
)
def test_long_rows_and_big_blocks_are_like_the_twin(dtype, shape, block):
    src = np.random.default_rng(3).integers(0, 256, shape).astype(dtype)
    for actual, expected in zip(minmax(src, block), twin(src, block), strict=True):
        assert same_bytes(actual, expected)


@pytest.mark.parametrize(("voxels", "blocks"), [(1, 1), (2, 1), (16, 1), (17, 1), (18, 2), (33, 2), (34, 3)])
def test_the_last_shared_voxel_opens_no_block_of_its_own(voxels, blocks):
    assert _native.block_minmax_shape((voxels, 1, 17), 16) == (blocks, 1, 1)


def test_a_shared_voxel_counts_in_both_blocks():
    src = np.zeros((1, 1, 33), np.uint8)
    src[0, 0, 16] = 9
    low, high = minmax(src, 16)
    assert low.ravel().tolist() == [0, 0]
    assert high.ravel().tolist() == [9, 9]


def trilinear(src, texture_coordinates):
    """Sample [..., zyx] texture coordinates with edges clamped, as GL does."""
    value = np.zeros(texture_coordinates.shape[:-1])
    size = np.array(src.shape)
    position = np.clip(texture_coordinates * size - 0.5, 0, size - 1)
    lower = np.minimum(np.floor(position).astype(int), np.maximum(size - 2, 0))
    fraction = position - lower
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, fraction, 1 - fraction), axis=-1)
        voxel = np.minimum(lower + corner, size - 1)
        value += weight * src[voxel[..., 0], voxel[..., 1], voxel[..., 2]]
    return value


@given(volumes(shapes=shapes), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_every_sample_of_the_field_lies_within_the_extremes_of_its_block(src, block, seed):
    assume(np.isfinite(src).all())
    low, high = minmax(src, block)
    texture_coordinates = np.random.default_rng(seed).random((200, 3))
    position = np.clip(texture_coordinates * src.shape - 0.5, 0, np.array(src.shape) - 1)
    index = tuple(np.minimum(position // block, np.array(low.shape) - 1).astype(int).T)
    value = trilinear(src.astype(np.float64), texture_coordinates)
    # The eight weights sum to 1 with a few roundings each.
    rounding = 16 * np.finfo(np.float64).eps * np.maximum(np.abs(low[index]), np.abs(high[index])).astype(np.float64)
    assert (value >= low[index] - rounding).all()
    assert (value <= high[index] + rounding).all()


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("voxel", [0, 7, 16])
def test_a_block_with_nan_never_looks_empty(sign, voxel):
    src = np.zeros((2, 3, 40), np.float32)
    src[1, 2, voxel] = np.copysign(np.float32(np.nan), sign)
    low, high = minmax(src, 16)
    expected = [voxel <= 16, voxel == 16, False]
    assert (low.ravel() == np.where(expected, -np.inf, 0)).all()
    assert (high.ravel() == np.where(expected, np.inf, 0)).all()


@pytest.mark.parametrize(
    ("low_shape", "high_shape", "block", "message"),
    [
        ((1, 1, 2), (1, 1, 1), 4, r"dst_min has shape \(1, 1, 2\), expected \(1, 1, 1\)"),
        ((1, 1, 1), (1, 2, 1), 4, r"dst_max has shape \(1, 2, 1\), expected \(1, 1, 1\)"),
        ((1, 1, 1), (1, 1, 1), 0, "block is 0, expected 1 to 1024"),
        ((1, 1, 1), (1, 1, 1), 1025, "block is 1025, expected 1 to 1024"),
    ],
)
def test_what_does_not_fit_is_a_value_error(low_shape, high_shape, block, message):
    src = np.zeros((3, 4, 5), np.uint8)
    with pytest.raises(ValueError, match=message):
        _native.block_minmax(src, block, np.zeros(low_shape, np.uint8), np.zeros(high_shape, np.uint8))


def test_arrays_of_another_type_or_order_are_a_type_error():
    src, dst = np.zeros((4, 4, 4), np.uint8), np.zeros((1, 1, 1), np.uint8)
    for low, high, message in [
        (dst.astype(np.int16), dst, "dst_min is int16, expected uint8"),
        (dst, dst.astype(np.int16), "dst_max is int16, expected uint8"),
    ]:
        with pytest.raises(TypeError, match=message):
            _native.block_minmax(src, 4, low, high)
    every_other = np.zeros((4, 4, 18), np.uint8)[:, :, ::2]
    two_blocks = np.zeros((1, 1, 4), np.uint8)[:, :, ::2]
    contiguous = np.zeros((1, 1, 2), np.uint8)
    for arrays in [
        (every_other, contiguous, contiguous.copy()),
        (np.ascontiguousarray(every_other), two_blocks, contiguous),
        (np.ascontiguousarray(every_other), contiguous, two_blocks),
    ]:
        with pytest.raises(TypeError, match="incompatible function arguments"):
            _native.block_minmax(arrays[0], 4, *arrays[1:])
