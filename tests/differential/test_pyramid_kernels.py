"""The kernels of the pyramid's filters against twins that gather every voxel of a support and add it up."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volumes import THREADS, VOXEL_TYPES, same_bytes, volumes

from volprep.kernels import _native
from volprep.parts.levels.weights import weights

LINEAR = ["bilinear", "binomial", "gaussian", "lanczos3"]
GATE = (3.0, 6.0)
integers = st.sampled_from(VOXEL_TYPES[:3])
factors = st.tuples(*[st.sampled_from([1, 2, 4, 8])] * 3)
block_factors = st.one_of(st.just((2, 2, 2)), st.tuples(*[st.integers(1, 5)] * 3), st.just((8, 4, 4)))


def level_of(src, factors):
    return np.empty(_native.box_reduced_shape(src.shape, factors), src.dtype)


def support(values, axis, factor, count):
    """Voxels that each voxel of the level is made from along one axis, on a new last axis."""
    cells = -(-values.shape[axis] // factor)
    first = np.arange(cells)[:, None] * factor - (count - factor) // 2
    index = np.clip(first + np.arange(count), 0, values.shape[axis] - 1)
    return np.moveaxis(np.take(values, index, axis), axis + 1, -1)


def linear_sums(src, factors, taps):
    """Weighted sums, and what they are divided by: exact integers, or float64 in the order that the contract states."""
    sums = src.astype(np.float64 if src.dtype.kind == "f" else np.int64)
    for axis, (factor, tap) in enumerate(zip(factors, taps, strict=True)):
        voxels = support(sums, axis, factor, len(tap))
        if len(tap) == 1:
            sums = voxels[..., 0]
            continue
        pairs = [(voxels[..., k] + voxels[..., -1 - k]) * tap[k] for k in range(len(tap) // 2)]
        sums = pairs[0]
        for pair in pairs[1:]:
            sums = sums + pair
    return sums, math.prod(int(tap.sum()) for tap in taps)


def block_range(src, factors, counts):
    low = high = src
    for axis, (factor, count) in enumerate(zip(factors, counts, strict=True)):
        low = support(low, axis, factor, count).min(axis=-1)
        high = support(high, axis, factor, count).max(axis=-1)
    return low, high


def rounded(values, dtype):
    if dtype.kind == "f":
        return np.where(np.isnan(values), np.float32(np.nan), values.astype(np.float32))
    return np.rint(values).astype(np.int64).astype(dtype)


def linear_twin(src, factors, taps, *, clamp):
    sums, divisor = linear_sums(src, factors, taps)
    # Exact: the sums have less than 53 bits, the divisor is a power of two.
    mean = sums / divisor
    if clamp:
        mean = np.clip(mean, *block_range(src, factors, [len(tap) for tap in taps]))
    elif src.dtype.kind != "f":
        mean = np.clip(mean, np.iinfo(src.dtype).min, np.iinfo(src.dtype).max)
    return rounded(mean, src.dtype)


def feature_twin(src, factors, taps, noise):
    sums, divisor = linear_sums(src, factors, taps)
    sizes = [int(tap.sum()) for tap in taps]
    # Bytes with small weights are blended in float32, which holds their sums exactly.
    real = np.float32 if src.dtype == np.uint8 and sizes[0] * sizes[1] <= 128 and sizes[2] <= 200 else np.float64
    base = (sums / divisor).astype(real)
    low, high = (each.astype(real) for each in block_range(src, factors, factors))
    above, below = high - base, base - low
    size = np.where(above >= below, above, below)
    start, width = real(GATE[0] * noise), real((GATE[1] - GATE[0]) * noise)
    with np.errstate(divide="ignore", invalid="ignore"):
        ramp = np.where(size - start < width, (size - start) * (real(1) / width), real(1))
    t = np.where(size - start > 0, ramp, real(0))
    deviation = np.where(above >= below, above, -below)
    return rounded(base + t * t * (real(3) - real(2) * t) * deviation, src.dtype)


def same_values(actual, expected):
    """The same bits, but for the sign of zero, which a sum may lose."""
    return same_bytes(actual + 0, expected + 0)


def finite(src):
    """The same volume without NaN and infinities, which no source of a package has."""
    return np.nan_to_num(src, nan=7.0, posinf=1e30, neginf=-1e30) if src.dtype.kind == "f" else src


@given(volumes(), factors, st.sampled_from(LINEAR), st.booleans())
def test_a_linear_filter_is_that_of_the_twin_bit_by_bit_on_any_number_of_threads(src, factors, name, clamp):
    src = finite(src)
    taps = [weights(name, factor) for factor in factors]
    expected = linear_twin(src, factors, taps, clamp=clamp)
    for threads in THREADS:
        level = level_of(src, factors)
        _native.linear_reduce(src, level, factors, *taps, clamp, threads=threads)
        assert same_values(level, expected), name


def test_the_ringing_of_an_edge_is_limited_by_voxels_far_from_the_cell():
    # Beside the edge the sums leave the range of the voxels at the centre of the support, on which the kernel looks
    # first, and that of the whole support is what counts.
    z, y, x = np.indices((26, 31, 33))
    for dtype in VOXEL_TYPES:
        src = np.where(x + y // 2 + z // 3 < 27, 60, 160).astype(dtype)
        taps = [weights("lanczos3", 2)] * 3
        level = level_of(src, (2, 2, 2))
        _native.linear_reduce(src, level, (2, 2, 2), *taps, clamp=True)
        assert same_bytes(level, linear_twin(src, (2, 2, 2), taps, clamp=True))
        free = linear_twin(src, (2, 2, 2), taps, clamp=False)
        assert free.min() < level.min() == 60
        centre = np.clip(free, *block_range(src, (2, 2, 2), (2, 2, 4)))
        assert (centre != level).any()


@given(volumes(), factors, st.sampled_from([0.0, 0.3, 5.0, 1e4]))
def test_the_feature_preserving_filter_is_that_of_the_twin_on_any_number_of_threads(src, factors, noise):
    src = finite(src)
    taps = [weights("binomial", factor) for factor in factors]
    expected = feature_twin(src, factors, taps, noise)
    for threads in THREADS:
        level = level_of(src, factors)
        _native.feature_reduce(src, level, factors, *taps, noise, *GATE, threads=threads)
        assert same_values(level, expected)


def blocks(src, factors):
    """Voxels of each block on the last axis; the edge is repeated."""
    padded = np.pad(src, [(0, -n % f) for n, f in zip(src.shape, factors, strict=True)], mode="edge")
    (fz, fy, fx), (z, y, x) = factors, [n // f for n, f in zip(padded.shape, factors, strict=True)]
    return padded.reshape(z, fz, y, fy, x, fx).transpose(0, 2, 4, 1, 3, 5).reshape(z, y, x, -1)


@given(volumes(types=integers), block_factors)
def test_the_median_is_the_rounded_mean_of_the_middle_two(src, factors):
    ordered = np.sort(blocks(src, factors), axis=-1).astype(np.int64)
    count = ordered.shape[-1]
    twice = ordered[..., (count - 1) // 2] + ordered[..., count // 2]
    expected = rounded(twice / 2, src.dtype)
    for threads in THREADS:
        level = level_of(src, factors)
        _native.median_reduce(src, level, factors, threads)
        assert same_bytes(level, expected)


def order_key(src):
    if src.dtype.kind != "f":
        return src
    bits = src.view(np.int32)
    return np.where(bits < 0, bits ^ 0x7FFFFFFF, bits)


@given(volumes(types=st.just(np.dtype(np.float32))), block_factors)
def test_the_median_of_floats_sorts_everything_that_is_special(src, factors):
    voxels = blocks(src, factors)
    ordered = np.take_along_axis(voxels, np.argsort(order_key(voxels), axis=-1), axis=-1)
    count = voxels.shape[-1]
    lower, upper = ordered[..., (count - 1) // 2], ordered[..., count // 2]
    with np.errstate(invalid="ignore"):
        expected = lower if count % 2 else rounded((lower.astype(np.float64) + upper) / 2, src.dtype)
    level = level_of(src, factors)
    _native.median_reduce(src, level, factors)
    assert same_bytes(level, expected.astype(np.float32))


@given(volumes(), block_factors)
def test_extrema_are_those_of_the_block_and_either_may_be_left_out(src, factors):
    voxels = blocks(src, factors)
    keys = order_key(voxels)
    least = np.take_along_axis(voxels, keys.argmin(axis=-1)[..., None], axis=-1)[..., 0]
    greatest = np.take_along_axis(voxels, keys.argmax(axis=-1)[..., None], axis=-1)[..., 0]
    for threads in THREADS:
        low, high, alone = (level_of(src, factors) for _ in range(3))
        _native.extrema_reduce(src, low, high, factors, threads)
        assert same_bytes(low, least)
        assert same_bytes(high, greatest)
        _native.extrema_reduce(src, None, alone, factors, threads)
        assert same_bytes(alone, greatest)


@given(volumes(types=integers), block_factors, st.sampled_from([None, 0, 2]))
def test_the_mode_is_the_smallest_of_the_most_frequent_and_the_background_does_not_count(src, factors, background):
    def mode(voxels):
        labels = voxels if background is None or (voxels == background).all() else voxels[voxels != background]
        found, count = np.unique(labels, return_counts=True)
        return found[count.argmax()]

    expected = np.apply_along_axis(mode, -1, blocks(src, factors))
    for threads in THREADS:
        level = level_of(src, factors)
        _native.mode_reduce(src, level, factors, background, threads)
        assert same_bytes(level, expected)


@given(volumes(), block_factors)
def test_the_nearest_voxel_is_the_one_at_the_centre_or_above(src, factors):
    index = [np.minimum(np.arange(-(-n // f)) * f + f // 2, n - 1) for n, f in zip(src.shape, factors, strict=True)]
    for threads in THREADS:
        level = level_of(src, factors)
        _native.nearest_reduce(src, level, factors, threads)
        assert same_bytes(level, src[np.ix_(*index)])


@pytest.mark.parametrize("dtype", VOXEL_TYPES, ids=str)
@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 5, 4099), (2, 3, 3001), (37, 1, 2), (1, 300, 1)], ids=str)
def test_long_rows_and_thin_volumes_are_reduced_like_the_twins(dtype, shape):
    src = np.random.default_rng(3).integers(0, 250, shape).astype(dtype)
    for factors in [(2, 2, 2), (1, 1, 4), (8, 8, 8)]:
        for name in LINEAR:
            taps = [weights(name, factor) for factor in factors]
            level = level_of(src, factors)
            _native.linear_reduce(src, level, factors, *taps, name == "lanczos3")
            assert same_bytes(level, linear_twin(src, factors, taps, clamp=name == "lanczos3"))
        median = level_of(src, factors)
        _native.median_reduce(src, median, factors)
        assert same_bytes(median, rounded(np.median(blocks(src, factors), axis=-1).astype(np.float64), src.dtype))


def test_the_largest_values_and_weights_lose_nothing():
    # 2048 / 1024 along each axis: the most that the kernel takes.
    taps = np.array([-256, 768, 768, -256], np.int32)
    for dtype in VOXEL_TYPES[:3]:
        low, high = np.iinfo(dtype).min, np.iinfo(dtype).max
        src = np.random.default_rng(0).choice(np.array([low, high], dtype), (9, 11, 13))
        for factors in [(2, 2, 2), (4, 2, 4), (1, 2, 2), (2, 1, 2), (2, 2, 1)]:
            level = level_of(src, factors)
            # Sums for wide weights, for narrow ones, and for those that come closest to their limit.
            for each in (taps, np.array([-36, 100, 100, -36], np.int32), *(weights(name, 2) for name in LINEAR)):
                along = [weights("bilinear", 1) if factor == 1 else each for factor in factors]
                _native.linear_reduce(src, level, factors, *along)
                assert same_bytes(level, linear_twin(src, factors, along, clamp=False))


def laplacian_bin(size):
    """2048 bins for sizes up to 2047, then 2048 for each power of two above: m and e of (2048 + m) * 2^e - 2048."""
    exponent = math.floor(math.log2(size + 2048)) - 11
    return 2048 * exponent + ((size + 2048) >> exponent) - 2048


@given(volumes(types=integers))
def test_the_histogram_of_the_laplacian_is_that_of_the_twin(src):
    wide = src.astype(np.int64)
    centre = tuple(slice(1, -1) if n >= 3 else slice(None) for n in src.shape)
    laplacian = np.zeros_like(wide[centre])
    flat = np.ones(laplacian.shape, bool)
    for axis, n in enumerate(src.shape):
        if n < 3:
            continue
        for side in (slice(None, -2), slice(2, None)):
            neighbour = wide[tuple(side if other == axis else part for other, part in enumerate(centre))]
            laplacian += neighbour - wide[centre]
            flat &= neighbour == wide[centre]
    bins = laplacian_bin(6 * (2 ** (8 * src.itemsize) - 1)) + 1
    expected = np.zeros(bins, np.uint64)
    for size in np.abs(laplacian[~flat]).tolist():
        expected[laplacian_bin(size)] += 1
    for threads in THREADS:
        histogram = np.zeros(bins, np.uint64)
        _native.laplacian_histogram(src, histogram, threads)
        assert np.array_equal(histogram, expected)


class TestWhatDoesNotFit:
    src = np.zeros((8, 6, 5), np.uint8)
    level = np.zeros((4, 3, 3), np.uint8)
    three = (np.array([1, 3, 3, 1], np.int32),) * 3

    @pytest.mark.parametrize(
        ("taps", "message"),
        [
            ([1, 2, 2, 1], "power of two"),
            ([1, 3, 3, 1, 0], "has 5 weights"),
            ([1, 3, 4], "has 3 weights"),
            ([0, 1, 3, 4], "symmetric"),
            ([-4096, 4097, 4097, -4096], "2048"),
            ([], "has 0 weights"),
        ],
    )
    def test_weights(self, taps, message):
        wrong = np.array(taps, np.int32)
        with pytest.raises(ValueError, match=message):
            _native.linear_reduce(self.src, self.level, (2, 2, 2), wrong, *self.three[:2])

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({"depth": 7}, "src is slices 0 to 7 of a volume of 7"),
            ({"depth": 16}, "dst needs slices 0 to 8, src is slices 0 to 7"),
            ({"src_z": 1, "depth": 9}, "dst needs slices 0 to 8"),
            ({"dst_z": 1}, "dst is slices 1 to 4 of a level of 4"),
            ({"threads": -1}, "threads is -1"),
        ],
    )
    def test_slabs(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            _native.linear_reduce(self.src, self.level, (2, 2, 2), *self.three, **arguments)

    @pytest.mark.parametrize(("noise", "low", "high"), [(-1, 3, 6), (math.nan, 3, 6), (1, 6, 3), (1, -1, 2)])
    def test_gates(self, noise, low, high):
        with pytest.raises(ValueError, match=r"noise is|the gate is"):
            _native.feature_reduce(self.src, self.level, (2, 2, 2), *self.three, noise, low, high)

    def test_a_base_that_does_not_cover_the_cell(self):
        two = np.ones(2, np.int32)
        with pytest.raises(ValueError, match="must cover the cell"):
            _native.feature_reduce(self.src, np.zeros((2, 3, 3), np.uint8), (4, 2, 2), two, two, two, 1.0)

    def test_blocks_backgrounds_and_types(self):
        for kernel in (_native.median_reduce, _native.nearest_reduce, _native.mode_reduce):
            with pytest.raises(ValueError, match="product of at most"):
                kernel(self.src, self.level, (2**11, 2**11, 1))
            with pytest.raises(ValueError, match="dst has shape"):
                kernel(self.src, self.level, (2, 2, 1))
            with pytest.raises(TypeError, match="dst is uint16, expected uint8"):
                kernel(self.src, self.level.astype(np.uint16), (2, 2, 2))
        with pytest.raises(ValueError, match="both None"):
            _native.extrema_reduce(self.src, None, None, (2, 2, 2))
        with pytest.raises(ValueError, match="background is 256, which uint8 cannot hold"):
            _native.mode_reduce(self.src, self.level, (2, 2, 2), 256)
        with pytest.raises(TypeError, match="src is float32, expected uint8 or int16 or uint16"):
            _native.mode_reduce(self.src.astype(np.float32), self.level.astype(np.float32), (2, 2, 2))
