"""box_reduce against a twin that pads, cuts into blocks and divides integers."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from volumes import THREADS, VOXEL_TYPES, same_bytes, volumes

from volprep.kernels import _native

factor = st.integers(1, 5)


def reduce(src, factors, threads=0):
    dst = np.empty(_native.box_reduced_shape(src.shape, factors), src.dtype)
    _native.box_reduce(src, dst, factors, threads)
    return dst


def twin(src, factors):
    padded = np.pad(src, [(0, -n % f) for n, f in zip(src.shape, factors, strict=True)], mode="edge")
    (fz, fy, fx), (z, y, x) = factors, [n // f for n, f in zip(padded.shape, factors, strict=True)]
    blocks = padded.reshape(z, fz, y, fy, x, fx).transpose(0, 2, 4, 1, 3, 5).reshape(z, y, x, fz * fy, fx)
    voxels = math.prod(factors)
    if src.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            rows = left_to_right(blocks.astype(np.float64))
            mean = left_to_right(rows) / voxels
        return np.where(np.isnan(mean), np.float32(np.nan), mean.astype(np.float32))
    floor, remainder = np.divmod(blocks.sum(axis=(3, 4), dtype=np.int64), voxels)
    up = (2 * remainder > voxels) | ((2 * remainder == voxels) & (floor % 2 == 1))
    return (floor + up).astype(src.dtype)


def left_to_right(values):
    total = values[..., 0]
    for k in range(1, values.shape[-1]):
        total = total + values[..., k]
    return total


@given(volumes(), st.one_of(st.just((2, 2, 2)), st.tuples(factor, factor, factor)))
def test_the_mean_is_that_of_the_twin_bit_by_bit_on_any_number_of_threads(src, factors):
    expected = twin(src, factors)
    for threads in THREADS:
        assert same_bytes(reduce(src, factors, threads), expected)


@pytest.mark.parametrize("dtype", VOXEL_TYPES, ids=str)
@pytest.mark.parametrize(
    "shape", [(1, 1, 1), (3, 5, 4099), (2, 3, 70001), (37, 1, 2), (1, 41, 1), (5, 33, 259)], ids=str
)
@pytest.mark.parametrize(
    "factors", [(2, 2, 2), (1, 1, 1), (1, 2, 2), (4, 4, 4), (2, 1, 3), (1, 1, 8), (7, 5, 33)], ids=str
)
def test_long_rows_and_thin_volumes_are_reduced_like_the_twin(dtype, shape, factors):
    rng = np.random.default_rng(5)
    src = (rng.normal(size=shape) * 60 + 100).clip(0, 255).astype(dtype)
    assert same_bytes(reduce(src, factors), twin(src, factors))


@pytest.mark.parametrize(
    ("dtype", "pair", "mean"),
    [
        (np.uint8, (0, 1), 0),
        (np.uint8, (1, 2), 2),
        (np.uint8, (254, 255), 254),
        (np.uint16, (65534, 65535), 65534),
        (np.int16, (-1, 0), 0),
        (np.int16, (-2, -1), -2),
        (np.int16, (-32768, -32767), -32768),
        (np.int16, (32766, 32767), 32766),
    ],
)
@pytest.mark.parametrize("factors", [(1, 1, 2), (2, 2, 2)], ids=str)
def test_a_half_goes_to_the_even_integer(dtype, pair, mean, factors):
    assert reduce(np.array([[pair]], dtype), factors).item() == mean


@pytest.mark.parametrize("factors", [(32, 32, 32), (33, 32, 32)], ids=str)
@pytest.mark.parametrize(
    ("dtype", "value"), [(np.uint16, 65535), (np.int16, -32768), (np.int16, 32767), (np.uint8, 255)]
)
def test_the_sum_of_extreme_values_does_not_overflow(factors, dtype, value):
    src = np.full(factors, value, dtype)
    assert reduce(src, factors).item() == value
    src[0, 0, 0] = 0
    assert reduce(src, factors).item() == round((value * (src.size - 1)) / src.size)


def test_a_factor_beyond_the_volume_repeats_the_edge():
    src = np.array([[[10, 20]]], np.uint8)
    assert reduce(src, (5, 3, 8)).item() == round((10 + 7 * 20) / 8)


def test_means_of_float32_do_not_overflow_and_keep_denormals():
    huge = np.finfo(np.float32).max
    tiny = np.finfo(np.float32).smallest_subnormal
    assert reduce(np.full((2, 2, 2), huge, np.float32), (2, 2, 2)).item() == huge
    assert reduce(np.full((2, 2, 2), tiny, np.float32), (2, 2, 2)).item() == tiny
    assert reduce(np.array([[[1, 1e-20]]], np.float32), (1, 1, 2)).item() == 0.5


@pytest.mark.parametrize("factors", [(2, 2, 2), (1, 1, 8)], ids=str)
def test_nan_propagates_with_one_spelling(factors):
    payload = np.array([0xFFC12345], np.uint32).view(np.float32)[0]
    for special in ([payload], [np.inf, -np.inf], [-payload, payload]):
        src = np.ones(8, np.float32)
        src[: len(special)] = special
        assert reduce(src.reshape(factors), factors).tobytes() == np.float32(np.nan).tobytes()
    src = np.ones(8, np.float32)
    src[3] = -np.inf
    assert reduce(src.reshape(factors), factors).item() == -np.inf


@given(volumes(), st.integers(1, 30), st.integers(1, 30), st.integers(1, 30))
def test_the_mean_lies_between_the_extremes(src, fz, fy, fx):
    assume(not np.isnan(src).any())
    reduced = reduce(src, (fz, fy, fx))
    bounded = reduced[~np.isnan(reduced)]
    assert ((bounded >= src.min()) & (bounded <= src.max())).all()


@pytest.mark.parametrize(
    ("dst_shape", "factors", "threads", "message"),
    [
        ((1, 2, 3), (2, 2, 2), 0, r"dst has shape \(1, 2, 3\), expected \(2, 2, 3\)"),
        ((2, 2, 3), (2, 0, 2), 0, r"factors_zyx is \(2, 0, 2\), expected factors of at least 1"),
        ((2, 2, 3), (2, -1, 2), 0, "factors of at least 1"),
        ((1, 1, 1), (2**11, 2**10, 2**11), 0, r"product of at most 2\^31"),
        ((1, 1, 1), (2**62, 4, 1), 0, r"product of at most 2\^31"),
        ((2, 2, 3), (2, 2, 2), -1, "threads is -1, expected 0"),
        ((2, 2, 3), (2, 2, 2), 1025, "threads is 1025"),
    ],
)
def test_what_does_not_fit_is_a_value_error(dst_shape, factors, threads, message):
    src = np.zeros((3, 4, 5), np.uint8)
    with pytest.raises(ValueError, match=message):
        _native.box_reduce(src, np.zeros(dst_shape, np.uint8), factors, threads)


def test_an_empty_volume_is_a_value_error():
    with pytest.raises(ValueError, match="at least one voxel"):
        _native.box_reduce(np.zeros((0, 4, 5), np.uint8), np.zeros((0, 2, 3), np.uint8), (2, 2, 2))


def test_arrays_that_would_have_to_be_copied_are_a_type_error():
    src, dst = np.zeros((4, 4, 4), np.uint16), np.zeros((2, 2, 2), np.uint16)
    read_only = dst.copy()
    read_only.flags.writeable = False
    for wrong_src, wrong_dst in [
        (src.transpose(), dst),
        (src[:, ::-1], dst),
        (src, dst[::-1]),
        (src.astype(">u2"), dst),
        (src[0], dst),
        (src, read_only),
    ]:
        with pytest.raises(TypeError, match="incompatible function arguments"):
            _native.box_reduce(wrong_src, wrong_dst, (2, 2, 2))


@pytest.mark.parametrize(
    ("src_type", "dst_type", "message"),
    [
        (np.int8, np.int8, "src is int8, expected uint8 or int16 or uint16 or float32"),
        (np.float64, np.float64, "src is float64"),
        (np.uint8, np.uint16, "dst is uint16, expected uint8"),
        (np.complex64, np.uint8, "src is type64"),
    ],
)
def test_types_that_no_kernel_takes_are_a_type_error(src_type, dst_type, message):
    with pytest.raises(TypeError, match=message):
        _native.box_reduce(np.zeros((2, 2, 2), src_type), np.zeros((1, 1, 1), dst_type), (2, 2, 2))


def test_a_read_only_source_is_enough():
    src = np.full((2, 2, 2), 7, np.int16)
    src.flags.writeable = False
    assert reduce(src, (2, 2, 2)).item() == 7
