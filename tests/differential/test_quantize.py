"""quantize against a twin that works voxel by voxel in float64."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volumes import THREADS, VOXEL_TYPES, same_bytes, volumes

from volprep.kernels import _native

CODES = [np.dtype(np.uint8), np.dtype(np.uint16)]


@dataclass(frozen=True)
class Loss:
    in_window: int
    clipped_below: int
    clipped_above: int
    non_finite: int
    sum_squared_error: float
    max_abs_error: float


def quantize(src, slope, intercept, window, dtype, *, threads=0):
    codes = np.empty(src.shape, dtype)
    histogram = np.zeros(np.iinfo(dtype).max + 1, np.uint64)
    loss = _native.quantize(src, slope, intercept, *window, codes, histogram, threads)
    return codes, histogram, loss


def plain(loss):
    return Loss(*(getattr(loss, name) for name in Loss.__dataclass_fields__))


def twin(src, slope, intercept, window, dtype):
    low, high = window
    last = np.iinfo(dtype).max
    step = (high - low) / last
    with np.errstate(all="ignore"):
        physical = slope * src.astype(np.float64) + intercept
        position = (physical - low) * (last / (high - low))
        codes = np.rint(np.clip(np.nan_to_num(position, nan=0.0), 0, last)).astype(dtype)
        inside = (physical >= low) & (physical <= high)
        steps = np.abs(position - codes)[inside]
    finite = np.isfinite(physical)
    loss = Loss(
        in_window=inside.sum(),
        clipped_below=(finite & (physical < low)).sum(),
        clipped_above=(finite & (physical > high)).sum(),
        non_finite=(~finite).sum(),
        sum_squared_error=sum(np.rint(steps**2 * 2.0**32).astype(int).tolist()) * 2.0**-32 * step**2,
        max_abs_error=steps.max(initial=0.0) * step,
    )
    return codes, np.bincount(codes.ravel(), minlength=last + 1).astype(np.uint64), loss


numbers = st.floats(-1e4, 1e4).filter(lambda number: number == 0 or abs(number) > 1e-6)
windows = st.tuples(numbers, numbers).filter(lambda ends: ends[1] - ends[0] > 1e-3)


@given(volumes(), st.sampled_from(CODES), numbers, numbers, windows)
def test_codes_histogram_and_loss_are_those_of_the_twin_on_any_number_of_threads(src, dtype, slope, intercept, window):
    expected_codes, expected_histogram, expected_loss = twin(src, slope, intercept, window, dtype)
    for threads in THREADS:
        codes, histogram, loss = quantize(src, slope, intercept, window, dtype, threads=threads)
        assert same_bytes(codes, expected_codes)
        assert same_bytes(histogram, expected_histogram)
        assert plain(loss) == expected_loss


@pytest.mark.parametrize("dtype", CODES, ids=str)
@pytest.mark.parametrize("stored", VOXEL_TYPES, ids=str)
def test_a_volume_of_many_chunks_is_quantised_like_the_twin(stored, dtype):
    rng = np.random.default_rng(11)
    src = (rng.normal(size=(7, 61, 127)) * 40 + 120).clip(0, 255).astype(stored)
    codes, histogram, loss = quantize(src, 0.37, -12.5, (-3.0, 70.0), dtype, threads=2)
    expected_codes, expected_histogram, expected_loss = twin(src, 0.37, -12.5, (-3.0, 70.0), dtype)
    assert same_bytes(codes, expected_codes)
    assert same_bytes(histogram, expected_histogram)
    assert plain(loss) == expected_loss
    assert min(expected_loss.clipped_below, expected_loss.clipped_above, expected_loss.in_window) > 0


@given(volumes(), st.sampled_from(CODES), windows, st.data())
def test_slabs_add_up_to_the_volume_exactly(src, dtype, window, data):
    cut = data.draw(st.integers(1, max(1, src.shape[0] - 1)))
    codes, histogram, whole = quantize(src, 0.75, 3.0, window, dtype)
    slab_codes = np.empty_like(codes)
    slab_histogram = np.zeros_like(histogram)
    total = None
    for part in (slice(0, cut), slice(cut, None)):
        if src[part].size:
            loss = _native.quantize(src[part], 0.75, 3.0, *window, slab_codes[part], slab_histogram)
            total = loss if total is None else total + loss
    assert same_bytes(slab_codes, codes)
    assert same_bytes(slab_histogram, histogram)
    assert plain(total) == plain(whole)


@given(volumes(), st.sampled_from(CODES), numbers, numbers, windows)
def test_every_voxel_is_accounted_for_and_the_error_is_at_most_half_a_step(src, dtype, slope, intercept, window):
    _, histogram, loss = quantize(src, slope, intercept, window, dtype)
    assert loss.in_window + loss.clipped_below + loss.clipped_above + loss.non_finite == src.size == histogram.sum()
    half_a_step = 0.5 * ((window[1] - window[0]) / np.iinfo(dtype).max)
    assert loss.max_abs_error <= half_a_step
    # Each square is rounded to 2^-32 step².
    bound = loss.in_window * (loss.max_abs_error**2 + (2 * half_a_step) ** 2 * 2.0**-33)
    assert loss.sum_squared_error <= bound * (1 + 1e-12)


@pytest.mark.parametrize(
    ("stored", "dtype"), [(np.uint8, np.uint8), (np.uint8, np.uint16), (np.uint16, np.uint16), (np.float32, np.uint16)]
)
def test_a_window_as_wide_as_the_codes_keeps_integers_exactly(stored, dtype):
    last = np.iinfo(dtype).max
    count = min(last, np.iinfo(stored).max if stored != np.float32 else last) + 1
    src = np.arange(count).reshape(1, -1, 256).astype(stored)
    codes, _, loss = quantize(src, 1.0, 0.0, (0.0, float(last)), dtype)
    assert (codes == src).all()
    assert loss.in_window == src.size
    assert (loss.sum_squared_error, loss.max_abs_error) == (0.0, 0.0)


@pytest.mark.parametrize("stored", VOXEL_TYPES, ids=str)
def test_halves_go_to_the_even_code_and_lose_half_a_step(stored):
    src = np.array([[[0, 1, 2, 3, 4, 5]]], stored)
    codes, _, loss = quantize(src, 1.0, 0.0, (0.0, 510.0), np.uint8)
    assert codes.ravel().tolist() == [0, 0, 1, 2, 2, 2]
    assert loss.max_abs_error == 1.0
    assert loss.sum_squared_error == 3.0


def test_special_floats_get_the_documented_codes():
    src = np.array([[[np.nan, -np.nan, -np.inf, np.inf, -1e30, 1e30, 1e-45, 255]]], np.float32)
    codes, _, loss = quantize(src, 1.0, 0.0, (0.0, 255.0), np.uint8)
    assert codes.ravel().tolist() == [0, 0, 0, 255, 0, 255, 0, 255]
    assert (loss.non_finite, loss.clipped_below, loss.clipped_above, loss.in_window) == (4, 1, 1, 2)


def test_the_end_of_the_window_is_in_the_window():
    low, high = 0.1, 0.7  # (high − low) · (255 / (high − low)) is not 255 exactly in float64
    src = np.array([[[1, 7]]], np.uint8)
    codes, _, loss = quantize(src, 0.1, 0.0, (low, 7 * 0.1), np.uint8)
    assert codes.ravel().tolist() == [0, 255]
    assert loss.in_window == 2
    assert high < 7 * 0.1


def test_counts_are_added_to_the_histogram():
    src = np.zeros((1, 1, 3), np.int16)
    codes = np.empty(src.shape, np.uint8)
    histogram = np.full(256, 5, np.uint64)
    _native.quantize(src, 1.0, 0.0, 0.0, 255.0, codes, histogram)
    assert histogram[0] == 8
    assert (histogram[1:] == 5).all()


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ((math.nan, 0, 0, 1), "slope is nan"),
        ((1, math.inf, 0, 1), "intercept inf"),
        ((1, 0, 1, 1), "the window is 1.0+ to 1.0+, expected an upper end above the lower one"),
        ((1, 0, 2, 1), "the window is 2.0+ to 1.0+"),
        ((1, 0, math.nan, 1), "the window is nan"),
        ((1, 0, 0, math.inf), "the window is"),
        ((1, 0, -1.7e308, 1.7e308), "the window is"),
        ((1, 0, 0, 1e-320), "the window is"),
    ],
)
def test_a_window_that_means_nothing_is_a_value_error(numbers, message):
    src = np.zeros((1, 1, 1), np.float32)
    with pytest.raises(ValueError, match=message):
        _native.quantize(src, *map(float, numbers), np.zeros((1, 1, 1), np.uint8), np.zeros(256, np.uint64))


@pytest.mark.parametrize(
    ("dst", "bins", "message"),
    [
        (np.zeros((1, 2, 3), np.uint8), 256, r"dst has shape \(1, 2, 3\), expected \(1, 2, 2\)"),
        (np.zeros((1, 2, 2), np.uint8), 255, "histogram has 255 entries, expected 256"),
        (np.zeros((1, 2, 2), np.uint16), 256, "histogram has 256 entries, expected 65536"),
    ],
)
def test_sizes_that_do_not_fit_are_a_value_error(dst, bins, message):
    with pytest.raises(ValueError, match=message):
        _native.quantize(np.zeros((1, 2, 2), np.int16), 1.0, 0.0, 0.0, 1.0, dst, np.zeros(bins, np.uint64))


def test_losses_of_different_windows_do_not_add():
    src = np.zeros((1, 1, 1), np.uint8)
    _, _, a = quantize(src, 1.0, 0.0, (0.0, 1.0), np.uint8)
    _, _, b = quantize(src, 1.0, 0.0, (0.0, 2.0), np.uint8)
    with pytest.raises(ValueError, match="different windows"):
        a + b


def test_arrays_of_another_type_or_order_are_a_type_error():
    src, dst, histogram = np.zeros((2, 2, 2), np.int16), np.zeros((2, 2, 2), np.uint8), np.zeros(256, np.uint64)
    for arrays, message in [
        ((src[::-1], dst, histogram), "incompatible"),
        ((src, dst[::-1], histogram), "incompatible"),
        ((src, dst, histogram.astype(np.int64)), "incompatible"),
        ((src, dst, np.zeros(512, np.uint64)[::2]), "incompatible"),
        ((src.astype(np.int32), dst, histogram), "src is int32, expected uint8 or int16 or uint16 or float32"),
        ((src, dst.astype(np.int8), histogram), "dst is int8, expected uint8 or uint16"),
    ]:
        with pytest.raises(TypeError, match=message):
            _native.quantize(arrays[0], 1.0, 0.0, 0.0, 1.0, *arrays[1:])
