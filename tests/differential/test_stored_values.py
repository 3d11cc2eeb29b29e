"""count_values, value_range and bin_values against NumPy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volumes import THREADS, VOXEL_TYPES, same_bytes, volumes

from volprep.kernels import _native

INTEGERS = [dtype for dtype in VOXEL_TYPES if dtype.kind != "f"]
integer_volumes = volumes(types=st.sampled_from(INTEGERS))
float_volumes = volumes(types=st.just(np.dtype(np.float32)))


@given(integer_volumes)
def test_every_stored_integer_is_counted_on_any_number_of_threads(src):
    info = np.iinfo(src.dtype)
    bins = info.max - info.min + 1
    expected = np.bincount(src.ravel().astype(np.int64) - info.min, minlength=bins).astype(np.uint64)
    for threads in THREADS:
        histogram = np.zeros(bins, np.uint64)
        _native.count_values(src, histogram, threads)
        assert same_bytes(histogram, expected)


@given(float_volumes)
def test_the_range_is_that_of_the_finite_voxels_and_the_others_are_counted(src):
    finite = src[np.isfinite(src)]
    for threads in THREADS:
        found = _native.value_range(src, threads)
        assert found.minimum == finite.min(initial=np.inf)
        assert found.maximum == finite.max(initial=-np.inf)
        assert found.nan == np.isnan(src).sum()
        assert found.negative_infinite == np.isneginf(src).sum()
        assert found.positive_infinite == np.isposinf(src).sum()


@pytest.mark.parametrize("zeros", [[-0.0], [0.0, -0.0], [-0.0, 0.0]])
def test_the_zero_of_a_range_is_positive(zeros):
    found = _native.value_range(np.array([[zeros]], np.float32))
    assert math.copysign(1, found.minimum) == math.copysign(1, found.maximum) == 1


def bins_of(src, low, high, bins):
    value = src.astype(np.float64)  # first: NumPy would compare float32 with `low` rounded to float32
    value = value[(value >= low) & (value <= high)]
    return np.minimum(np.floor((value - low) * (bins / (high - low))), bins - 1).astype(int)


ends = st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)).filter(lambda pair: pair[1] - pair[0] > 1e-3)


@given(float_volumes, ends, st.sampled_from([1, 2, 7, 256, 65536]))
def test_bins_are_those_of_the_twin_on_any_number_of_threads(src, ends, bins):
    low, high = ends
    expected = np.bincount(bins_of(src, low, high, bins), minlength=bins).astype(np.uint64)
    for threads in THREADS:
        histogram = np.zeros(bins, np.uint64)
        _native.bin_values(src, low, high, histogram, threads)
        assert same_bytes(histogram, expected)


def test_both_ends_of_the_range_are_binned_and_nothing_beyond():
    src = np.array([[[0, 1, 4, np.nextafter(np.float32(4), np.float32(5)), -1e-45, np.nan, np.inf]]], np.float32)
    histogram = np.zeros(4, np.uint64)
    _native.bin_values(src, 0.0, 4.0, histogram)
    assert histogram.tolist() == [1, 1, 0, 1]


@pytest.mark.parametrize("count", [_native.count_values, lambda src, bins: _native.bin_values(src, 0.0, 10.0, bins)])
def test_slabs_add_up_to_the_volume(count):
    rng = np.random.default_rng(2)
    dtype = np.uint8 if count is _native.count_values else np.float32
    src = rng.integers(0, 12, (9, 61, 37)).astype(dtype)
    whole, slabs = np.zeros(256, np.uint64), np.zeros(256, np.uint64)
    count(src, whole)
    for slab in (src[:4], src[4:]):
        count(slab, slabs)
    assert same_bytes(slabs, whole)


def test_sizes_and_ranges_that_do_not_fit_are_a_value_error():
    stored, values, bins = np.zeros((1, 1, 1), np.int16), np.zeros((1, 1, 1), np.float32), np.zeros(8, np.uint64)
    with pytest.raises(ValueError, match="histogram has 8 entries, expected 65536"):
        _native.count_values(stored, bins)
    with pytest.raises(ValueError, match="histogram has 0 entries, expected 1 to 65536"):
        _native.bin_values(values, 0.0, 1.0, bins[:0])
    with pytest.raises(ValueError, match="histogram has 65537 entries"):
        _native.bin_values(values, 0.0, 1.0, np.zeros(65537, np.uint64))
    for low, high in [(1.0, 1.0), (2.0, 1.0), (math.nan, 1.0), (0.0, math.inf), (0.0, 1e-320)]:
        with pytest.raises(ValueError, match="the range is"):
            _native.bin_values(values, low, high, bins)
    with pytest.raises(TypeError, match="src is float32, expected uint8 or int16 or uint16"):
        _native.count_values(values, bins)
    with pytest.raises(ValueError, match="at least one voxel"):
        _native.value_range(np.zeros((0, 1, 1), np.float32))


@pytest.mark.parametrize("threads", [0, 1, 2, 3])
def test_the_bandwidth_loops_touch_every_byte(threads):
    words = np.random.default_rng(1).integers(0, 2**64, 10007, np.uint64)
    assert _native.memory_read(words, threads) == int(np.sum(words, dtype=np.uint64))
    copied = np.zeros(words.nbytes, np.uint8)
    _native.memory_copy(words.view(np.uint8), copied, threads)
    assert same_bytes(copied, words.view(np.uint8))
    with pytest.raises(ValueError, match="dst has 1 bytes, expected 80056"):
        _native.memory_copy(words.view(np.uint8), copied[:1])
