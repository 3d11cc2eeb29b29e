"""gradient, normals and coarse_normals against twins that pad, convolve and round in the obvious way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volumes import THREADS, same_bytes, volumes

from volprep.kernels import _native

KERNELS = ("forward", "central", "thesis", "sobel", "isotropic")
CODES = ("biased8", "snorm8", "oct8", "oct12")
PLANES = {
    "thesis": np.array([[1, 3, 1], [3, 6, 3], [1, 3, 1]]),
    "sobel": np.outer([1, 2, 1], [1, 2, 1]),
    "isotropic": np.outer([1, 4, 1], [1, 4, 1]),
}
ENDS = (False, False)
EVEN = (1.0, 1.0, 1.0)
STRETCH = (1.0, 0.5, 0.01)
codes_8_16 = volumes(types=st.sampled_from([np.dtype(np.uint8), np.dtype(np.uint16)]))


def sums_twin(src, kernel):
    """Sums of differences [z, y, x, (x, y, z)], exact."""
    values = src.astype(np.int64)
    padded = np.pad(values, 1, mode="edge")
    components = []
    for axis in (2, 1, 0):
        at = [slice(1, -1)] * 3
        if kernel == "forward":
            slope = np.diff(values, axis=axis)
            if slope.shape[axis] == 0:
                components.append(np.zeros_like(values))
                continue
            components.append(np.concatenate([slope, np.take(slope, [-1], axis=axis)], axis=axis))
            continue
        plane = PLANES.get(kernel, np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0]]))
        total = np.zeros_like(values)
        across = [other for other in range(3) if other != axis]
        for i in range(3):
            for j in range(3):
                at[across[0]], at[across[1]] = shifted(i, values.shape[across[0]]), shifted(j, values.shape[across[1]])
                at[axis] = shifted(2, values.shape[axis])
                after = padded[tuple(at)]
                at[axis] = shifted(0, values.shape[axis])
                total += plane[i, j] * (after - padded[tuple(at)])
        ends = np.ones(values.shape[axis], np.int64)
        ends[[0, -1]] = 2
        components.append(total * np.expand_dims(ends, [other for other in range(3) if other != axis]))
    return np.stack(components, axis=-1)


def shifted(start, length):
    return slice(start, start + length)


def vectors_twin(sums, scale):
    return sums.astype(np.float32) * np.array(scale, np.float32)


def codes_twin(vectors, code):
    v = vectors.astype(np.float32)
    x, y, z = np.moveaxis(v, -1, 0)
    one = np.float32(1)
    squared = (x * x + y * y) + z * z
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(squared > 0, np.float32(127) / np.sqrt(squared), np.float32(0))
        total = (abs(x) + abs(y)) + abs(z)
        largest = np.float32(127 if code == "oct8" else 2047)
        unfold = largest / total
        p, q = x * unfold, y * unfold
        u = np.where(z < 0, np.copysign(largest - abs(q), x), p)
        w = np.where(z < 0, np.copysign(largest - abs(p), y), q)
    if code in {"biased8", "snorm8"}:
        rounded = np.rint(v * scale[..., None]).astype(np.int64)
        octets = rounded + 128 if code == "biased8" else rounded % 256
    else:
        some = total > 0
        u, w = (np.where(some, np.rint(np.where(some, each, 0)) + largest + one, 0).astype(np.int64) for each in (u, w))
        if code == "oct8":
            octets = np.stack([u, w], axis=-1)
        else:
            octets = np.stack([u & 255, (u >> 8) | ((w & 15) << 4), w >> 4], axis=-1)
    return octets.astype(np.uint8)


def gradient(src, kernel, scale=EVEN, halo=ENDS, threads=0):
    dst = np.empty((src.shape[0] - sum(halo), *src.shape[1:], 3), np.float32)
    _native.gradient(src, kernel, halo, scale, dst, threads)
    return dst


def octets_of(code):
    return 2 if code == "oct8" else 3


def normals(src, kernel, code, scale=EVEN, *, halo=ENDS, threads=0):
    dst = np.empty((src.shape[0] - sum(halo), *src.shape[1:], octets_of(code)), np.uint8)
    _native.normals(src, kernel, halo, scale, code, dst, threads)
    return dst


def coarse(src, kernel, factors, code, scale=EVEN, *, halo=ENDS, threads=0):
    inner = (src.shape[0] - sum(halo), *src.shape[1:])
    shape = [-(-n // f) for n, f in zip(inner, factors, strict=True)]
    dst = np.empty((*shape, octets_of(code)), np.uint8)
    _native.coarse_normals(src, kernel, halo, factors, scale, code, dst, threads)
    return dst


def coarse_twin(src, kernel, factors, code, scale=EVEN):
    """Mean of the vectors of each block; turned to one side where they cancel."""
    sums = sums_twin(src, kernel)
    pads = [(0, -n % f) for n, f in zip(src.shape, factors, strict=True)]
    blocks = np.pad(sums, [*pads, (0, 0)], mode="edge")
    (fz, fy, fx), (z, y, x) = factors, [n // f for n, f in zip(blocks.shape[:3], factors, strict=True)]
    blocks = blocks.reshape(z, fz, y, fy, x, fx, 3).transpose(0, 2, 4, 1, 3, 5, 6).reshape(z, y, x, -1, 3)
    scales = np.array(scale, np.float32).astype(np.float64)
    plain = scales * blocks.sum(axis=3)
    turned, lengths = [], []
    for axis in range(3):
        sign = np.where(blocks[..., axis : axis + 1] < 0, -1, 1)
        total = (sign * blocks).sum(axis=3)
        turned.append(scales * total)
        lengths.append(scales[axis] * total[..., axis])
    best = np.argmax(np.stack(lengths), axis=0)
    chosen = np.take_along_axis(np.stack(turned), best[None, ..., None], axis=0)[0]
    sign = np.where(dot(chosen, plain) < 0, -1.0, 1.0)[..., None]
    mean = np.where((dot(chosen, chosen) > 4 * dot(plain, plain))[..., None], sign * chosen, plain)
    return codes_twin((mean / (fz * fy * fx)).astype(np.float32), code)


def dot(a, b):
    return (a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]) + a[..., 2] * b[..., 2]


@given(codes_8_16, st.sampled_from(KERNELS), st.sampled_from([EVEN, STRETCH]))
def test_the_gradient_is_that_of_the_twin_bit_by_bit_on_any_number_of_threads(src, kernel, scale):
    expected = vectors_twin(sums_twin(src, kernel), scale) + np.float32(0)
    for threads in THREADS:
        assert same_bytes(gradient(src, kernel, scale, threads=threads) + np.float32(0), expected)


@given(codes_8_16, st.sampled_from(KERNELS), st.sampled_from(CODES), st.sampled_from([EVEN, STRETCH]))
def test_the_codes_are_those_of_the_twin_on_any_number_of_threads(src, kernel, code, scale):
    expected = codes_twin(vectors_twin(sums_twin(src, kernel), scale), code)
    for threads in THREADS:
        assert same_bytes(normals(src, kernel, code, scale, threads=threads), expected)


@pytest.mark.parametrize("code", ["biased8", "snorm8"])
def test_of_a_million_directions_not_one_is_rounded_otherwise_than_by_the_twin(code):
    # A CPU's approximation of 1 / √x and a Newton step round about 50 of these numbers otherwise.
    src = np.random.default_rng(4).integers(0, 65536, (16, 128, 512), np.uint16)
    assert same_bytes(normals(src, "thesis", code), codes_twin(sums_twin(src, "thesis"), code))


factor = st.integers(1, 5)


@given(
    codes_8_16,
    st.sampled_from(KERNELS),
    st.tuples(factor, factor, factor),
    st.sampled_from(CODES),
    st.sampled_from([EVEN, STRETCH]),
)
def test_coarse_normals_are_those_of_the_twin_on_any_number_of_threads(src, kernel, factors, code, scale):
    expected = coarse_twin(src, kernel, factors, code, scale)
    for threads in THREADS:
        assert same_bytes(coarse(src, kernel, factors, code, scale, threads=threads), expected)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(1, 1, 1), (2, 2, 2), (3, 67, 5), (2, 130, 3), (3, 2, 1029), (1, 65, 513)], ids=str)
@pytest.mark.parametrize("kernel", KERNELS)
def test_long_rows_and_thin_volumes_are_like_the_twin(dtype, shape, kernel):
    src = np.random.default_rng(5).integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    vectors = vectors_twin(sums_twin(src, kernel), STRETCH)
    assert same_bytes(normals(src, kernel, "biased8", STRETCH), codes_twin(vectors, "biased8"))
    assert same_bytes(coarse(src, kernel, (2, 3, 4), "oct12"), coarse_twin(src, kernel, (2, 3, 4), "oct12"))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("cut", [1, 2, 4, 7])
def test_slabs_with_a_halo_give_the_bytes_of_the_whole(kernel, cut):
    src = np.random.default_rng(6).integers(0, 256, (9, 13, 17), np.uint8)
    whole = normals(src, kernel, "biased8", STRETCH)
    small = coarse(src, kernel, (2, 2, 2), "biased8", STRETCH)
    pieces, blocks = [], []
    for z0 in range(0, len(src), cut):
        z1 = min(z0 + cut, len(src))
        halo = (z0 > 0, z1 < len(src))
        slab = src[z0 - halo[0] : z1 + halo[1]]
        pieces.append(normals(slab, kernel, "biased8", STRETCH, halo=halo))
        if cut % 2 == 0:
            blocks.append(coarse(slab, kernel, (2, 2, 2), "biased8", STRETCH, halo=halo))
    assert same_bytes(np.concatenate(pieces), whole)
    if blocks:
        assert same_bytes(np.concatenate(blocks), small)


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_gradient_of_float32_is_that_of_the_same_numbers_as_integers(kernel):
    src = np.random.default_rng(8).integers(0, 65536, (5, 7, 9), np.uint16)
    # Sums of up to 36 · 65535 have no rounding in float32.
    assert same_bytes(gradient(src.astype(np.float32), kernel) + np.float32(0), gradient(src, kernel) + np.float32(0))


@pytest.mark.parametrize(("kernel", "divisor"), list(zip(KERNELS, (1, 2, 44, 32, 72), strict=True)))
def test_a_ramp_has_its_slope_everywhere_the_border_included(kernel, divisor):
    z, y, x = np.indices((5, 6, 7))
    ramp = (3 * x + 5 * y + 7 * z).astype(np.uint8)
    assert (gradient(ramp, kernel) == np.float32(divisor) * np.array([3, 5, 7], np.float32)).all()


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("code", CODES)
def test_a_constant_volume_has_no_normals_only_the_flag(kernel, code):
    flag = {"biased8": [128] * 3, "snorm8": [0] * 3, "oct8": [0] * 2, "oct12": [0] * 3}[code]
    src = np.full((4, 5, 6), 200, np.uint8)
    assert (normals(src, kernel, code, STRETCH) == flag).all()
    assert (coarse(src, kernel, (2, 2, 2), code, STRETCH) == flag).all()


@given(codes_8_16, st.sampled_from(KERNELS), st.sampled_from(CODES))
def test_a_gradient_never_has_the_flag(src, kernel, code):
    flag = {"biased8": [128] * 3, "snorm8": [0] * 3, "oct8": [0] * 2, "oct12": [0] * 3}[code]
    flagged = (normals(src, kernel, code) == flag).all(axis=-1)
    assert (flagged == (sums_twin(src, kernel) == 0).all(axis=-1)).all()


def test_a_thin_sheet_inside_a_block_keeps_its_normal():
    src = np.zeros((8, 8, 8), np.uint8)
    src[2:4] = 100
    src[:, :, 5] += 1
    found = coarse(src, "central", (8, 8, 8), "biased8")[0, 0, 0].astype(int) - 128
    assert abs(found[2]) == 127
    assert abs(found[:2]).max() <= 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kernel": "prewitt"}, "kernel is prewitt, expected forward"),
        ({"code": "oct16"}, "code is oct16, expected biased8"),
        ({"scale": (np.nan, 1.0, 1.0)}, "scale_xyz has a number that is not finite"),
        ({"halo": (True, True)}, "src has 2 slices, halo included: none is left"),
        ({"dst": (2, 3, 4, 2)}, "dst has 2 numbers a voxel, expected 3"),
        ({"dst": (2, 3, 5, 3)}, r"dst has shape \(2, 3, 5\), expected \(2, 3, 4\)"),
        ({"threads": -1}, "threads is -1"),
    ],
)
def test_what_does_not_fit_is_a_value_error(change, message):
    given_ = {"kernel": "thesis", "code": "biased8", "scale": EVEN, "halo": ENDS, "threads": 0} | change
    dst = np.zeros(given_.pop("dst", (2, 3, 4, 3)), np.uint8)
    src = np.zeros((2, 3, 4), np.uint8)
    keys = ("kernel", "halo", "scale", "code")
    with pytest.raises(ValueError, match=message):
        _native.normals(src, *(given_[key] for key in keys), dst, given_["threads"])


@pytest.mark.parametrize("factors", [(0, 1, 1), (1, -1, 1), (2**10, 2**7, 1), (1, 1, 2**17)], ids=str)
def test_factors_whose_sums_could_overflow_are_a_value_error(factors):
    with pytest.raises(ValueError, match="expected factors of at least 1"):
        _native.coarse_normals(
            np.zeros((2, 2, 2), np.uint8), "thesis", ENDS, factors, EVEN, "oct8", np.zeros((1, 1, 1, 2), np.uint8)
        )


def test_types_that_no_kernel_takes_are_a_type_error():
    with pytest.raises(TypeError, match="src is int16, expected uint8 or uint16 or float32"):
        normals(np.zeros((2, 2, 2), np.int16), "thesis", "biased8")
