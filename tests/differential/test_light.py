"""Light along rays, its slopes, and levels fitted to level 0, against twins that a student could check by eye."""

import numpy as np
import pytest

from volprep.kernels import _native

RNG = np.random.default_rng(5)


def rays(count: int = 30) -> dict[str, np.ndarray]:
    counts = RNG.integers(1, 40, count)
    return {
        "samples": RNG.uniform(-5, 260, counts.sum()).astype(np.float32),
        "offsets": np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        "lengths_mm": RNG.uniform(0.5, 30.0, count),
    }


def table(entries: int) -> np.ndarray:
    return np.column_stack([RNG.random((entries, 3)), RNG.random(entries) * 0.3])


def slow_light(bundle: dict[str, np.ndarray], scale: float, entries: np.ndarray) -> np.ndarray:
    light = np.zeros((len(bundle["lengths_mm"]), 4))
    for ray, (begin, end) in enumerate(zip(bundle["offsets"][:-1], bundle["offsets"][1:], strict=True)):
        step_mm = bundle["lengths_mm"][ray] / (end - begin)
        left = 1.0
        for sample in bundle["samples"][begin:end].astype(np.float64):
            place = np.clip(sample * scale, 0, 1)
            *colour, extinction = (np.interp(place, np.linspace(0, 1, len(entries)), part) for part in entries.T)
            opacity = 1 - np.exp(-extinction * step_mm)
            light[ray, :3] += left * opacity * np.array(colour)
            left *= 1 - opacity
        light[ray, 3] = 1 - left
    return light


def native_light(bundle: dict[str, np.ndarray], scale: float, entries: np.ndarray, threads: int = 0) -> np.ndarray:
    light = np.empty((len(bundle["lengths_mm"]), 4))
    _native.ray_light(bundle["samples"], bundle["offsets"], bundle["lengths_mm"], scale, entries, light, threads)
    return light


@pytest.mark.parametrize("entries", [2, 7, 256])
def test_light_is_that_of_segments_from_front_to_back(entries) -> None:
    bundle, colours = rays(), table(entries)
    np.testing.assert_allclose(
        native_light(bundle, 1 / 255, colours), slow_light(bundle, 1 / 255, colours), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("knots", [5, 17])
def test_the_equations_are_those_of_differences_of_light(knots) -> None:
    bundle, common = rays(12), table(17)
    common[3, 3] = 0.0
    target = RNG.random((12, 4))
    n = 4 * knots
    matrix, gradient = np.empty((n, n)), np.empty(n)
    light = native_light(bundle, 1 / 255, common)
    arguments = (bundle["samples"], bundle["offsets"], bundle["lengths_mm"], 1 / 255, common, light, target)
    _native.light_equations(*arguments, matrix, gradient)
    again = np.empty((n, n)), np.empty(n)
    _native.light_equations(*arguments, *again, 3)
    assert np.array_equal(again[0], matrix)
    assert np.array_equal(again[1], gradient)
    places = np.linspace(0, 1, 17)

    def changed(unknown: int, step: float) -> np.ndarray:
        channel, knot = divmod(unknown, knots)
        # Light between two entries depends on their own values: a change is taken where the samples are.
        hat = np.interp(places, np.linspace(0, 1, knots), np.eye(knots)[knot])
        result = common.copy()
        if channel < 3:
            result[:, channel] += step * hat
        else:
            # By the chain rule: the square root moves, and the extinction with twice the root.
            result[:, 3] += step * hat
        return result

    step = 1e-6
    slopes = np.stack(
        [
            (native_light(bundle, 1 / 255, changed(k, step)) - native_light(bundle, 1 / 255, changed(k, -step)))
            / (2 * step)
            for k in range(3 * knots)
        ]
    )
    residual = light - target
    colours = slice(0, 3 * knots)
    np.testing.assert_allclose(gradient[colours], np.einsum("krc,rc->k", slopes, residual) / 12, atol=1e-8)
    expected = np.einsum("krc,lrc->kl", slopes, slopes) / 12
    np.testing.assert_allclose(matrix[colours, colours], expected, atol=1e-8)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-15)


def test_the_slopes_by_the_root_of_a_constant_extinction_are_those_of_differences() -> None:
    bundle, common = rays(12), table(9)
    common[:, 3] = 0.04
    target = np.zeros((12, 4))
    matrix, gradient = np.empty((36, 36)), np.empty(36)
    light = native_light(bundle, 1 / 255, common)
    _native.light_equations(
        bundle["samples"], bundle["offsets"], bundle["lengths_mm"], 1 / 255, common, light, target, matrix, gradient
    )
    step = 1e-6
    for knot in range(9):
        ends = []
        for sign in (1, -1):
            moved = common.copy()
            # Between two entries the extinction is a chord, so that its slope by the root is that of the entries.
            moved[knot, 3] += sign * step * 2 * np.sqrt(0.04)
            ends.append(native_light(bundle, 1 / 255, moved))
        slope = (ends[0] - ends[1]) / (2 * step)
        assert gradient[27 + knot] == pytest.approx((slope * light).sum() / 12, rel=1e-5, abs=1e-9)
        assert matrix[27 + knot, 27 + knot] == pytest.approx((slope**2).sum() / 12, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("n", [1, 2, 9, 40])
def test_equations_are_solved(n) -> None:
    half = RNG.normal(size=(n, n))
    matrix = half @ half.T + np.eye(n)
    rhs = RNG.normal(size=n)
    solution = rhs.copy()
    assert _native.solve_positive(matrix.copy(), solution)
    np.testing.assert_allclose(matrix @ solution, rhs, atol=1e-9)


def test_a_matrix_that_is_not_positive_definite_is_refused() -> None:
    assert not _native.solve_positive(np.array([[1.0, 2.0], [2.0, 1.0]]), np.ones(2))


@pytest.mark.parametrize("shape_zyx", [(9, 7, 5), (1, 4, 6), (2, 1, 1)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_samples_are_trilinear_and_slabs_give_each_once(shape_zyx, dtype) -> None:
    volume = RNG.integers(0, 250, shape_zyx).astype(dtype)
    extent_xyz = np.array(shape_zyx[::-1], dtype=float)
    starts = RNG.uniform(-0.5, 0.5, (40, 3)) + RNG.integers(0, 2, (40, 3)) * (extent_xyz - 1)
    directions = RNG.normal(size=(40, 3))
    directions[0] = (1.0, 0.0, 0.0)
    lengths = RNG.uniform(1.0, 4.0, 40)
    counts = RNG.integers(1, 9, 40)
    counts[:4] = 32, 33, 64, 90
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    whole = np.full(offsets[-1], np.nan, np.float32)
    _native.sample_rays(volume, 0, shape_zyx[0], starts, directions, lengths, offsets, whole)
    expected = []
    for ray, count in enumerate(counts):
        for t in (np.arange(count) + 0.5) * lengths[ray] / count:
            xyz = np.clip(starts[ray] + t * directions[ray], 0, extent_xyz - 1)
            low = np.minimum(xyz.astype(int), np.maximum(extent_xyz.astype(int) - 2, 0))
            value = 0.0
            for corner in np.ndindex(2, 2, 2):
                place = np.minimum(low + corner, extent_xyz.astype(int) - 1)
                weight = np.prod(np.where(corner, xyz - low, 1 - (xyz - low)))
                value += weight * float(volume[tuple(place[::-1])])
            expected.append(value)
    np.testing.assert_allclose(whole, expected, rtol=1e-5, atol=1e-4)
    pieces = np.full(offsets[-1], np.nan, np.float32)
    for z in range(max(shape_zyx[0] - 1, 1)):
        slab = np.ascontiguousarray(volume[z : z + 2])
        _native.sample_rays(slab, z, shape_zyx[0], starts, directions, lengths, offsets, pieces, 2)
    assert np.array_equal(pieces, whole)


def weights_of(voxels: int, factor: int) -> np.ndarray:
    """The trilinear field at the voxels of level 0 as a matrix [voxel, voxel of the level], along one axis."""
    length = -(-voxels // factor)
    places = np.clip((np.arange(voxels) + 0.5) / factor - 0.5, 0, length - 1)
    return np.stack([np.interp(places, np.arange(length), row) for row in np.eye(length)], axis=1)


FITS = [((9, 7, 11), (2, 2, 2)), ((5, 9, 8), (1, 4, 2)), ((1, 1, 6), (1, 1, 2)), ((4, 5, 7), (3, 1, 3))]


def moved(start, samples, table, fine, factors, *, left=0) -> np.ndarray:
    """Make a step of 1.5 by the formula: values [z, y, x] and looks [z, y, x, 4], one transfer function.

    Where cells have two rows along z and y or more, the step takes every second row.
    """
    values, looks = samples
    spread = [weights_of(n, f) for n, f in zip(values.shape, factors, strict=True)]
    field = np.einsum("zk,yj,xi,kji->zyx", *spread, start.astype(float))
    k = np.minimum(field.astype(int), len(table) - 2)
    slopes = np.diff(table, axis=0)[k]
    missing = looks - table[k] - (field - k)[..., None] * slopes
    force = 0.3 * (values - field) + fine * (slopes * missing).sum(-1)
    stiffness = 0.3 + fine * (slopes**2).sum(-1)
    z, y, _ = np.ogrid[tuple(slice(n) for n in values.shape)]
    taken = (z + y + left + 1) % min(2, *factors[:2]) == 0
    pulls = [np.einsum("zk,yj,xi,zyx->kji", *spread, each * taken) for each in (force, stiffness)]
    return np.clip(start + 1.5 * pulls[0] / pulls[1], 0, len(table) - 1)


def weighted(shape_zyx) -> tuple[np.ndarray, np.ndarray]:
    """Weights of blocks of 2×2×2, and of the voxels in them."""
    blocks = RNG.random(tuple(-(-n // 2) for n in shape_zyx)).astype(np.float32)
    return blocks[None], np.kron(blocks, np.ones((2, 2, 2)))[tuple(slice(n) for n in shape_zyx)]


@pytest.mark.parametrize(("shape_zyx", "factors"), FITS)
def test_a_fitted_level_moves_as_the_formula_says(shape_zyx, factors) -> None:
    volume = RNG.integers(0, 256, shape_zyx).astype(np.uint8)
    reduced = tuple(-(-n // f) for n, f in zip(shape_zyx, factors, strict=True))
    start = RNG.uniform(0, 255, reduced).astype(np.float32)
    table = RNG.random((256, 4)).astype(np.float32)
    blocks, fine = weighted(shape_zyx)
    level, expected = start.copy(), start
    _native.fit_level(volume, level, factors, 0, (0, reduced[0]), 1.0, 0.3, table[None], blocks, (2, 2, 2), 2, 1.5)
    for left in (1, 0):
        expected = moved(expected, (volume, table[volume]), table, fine, factors, left=left)
    np.testing.assert_allclose(level, expected, rtol=2e-5, atol=2e-3)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize(("shape_zyx", "factors"), [*FITS, ((3, 70, 9), (8, 2, 4)), ((5, 7, 6), (5, 7, 6))])
def test_a_level_fitted_to_values_moves_as_the_formula_says(shape_zyx, factors, dtype) -> None:
    largest = {np.uint8: 255, np.uint16: 65535, np.float32: 90}[dtype]
    volume = (RNG.random(shape_zyx) * largest).astype(dtype)
    reduced = tuple(-(-n // f) for n, f in zip(shape_zyx, factors, strict=True))
    expected = RNG.uniform(0, largest, reduced).astype(np.float32)
    level = expected.copy()
    spread = [weights_of(n, f) for n, f in zip(shape_zyx, factors, strict=True)]
    for _ in range(3):
        field = np.einsum("zk,yj,xi,kji->zyx", *spread, expected.astype(float))
        force = np.einsum("zk,yj,xi,zyx->kji", *spread, volume - field)
        expected += 1.5 * force / np.einsum("zk,yj,xi->kji", *spread)
        expected = np.clip(expected, 0, largest)
    _native.fit_values(volume, level, factors, largest, 3, 1.5)
    np.testing.assert_allclose(level, expected, atol=1e-5 * largest)


@pytest.mark.parametrize(("shape_zyx", "factors"), FITS)
def test_a_level_is_fitted_to_means_by_the_same_formula(shape_zyx, factors) -> None:
    values = RNG.uniform(0, 255, shape_zyx).astype(np.float32)
    z, y, x = shape_zyx
    looks = RNG.random((z, 1, y, x, 4)).astype(np.float32)
    reduced = tuple(-(-n // f) for n, f in zip(shape_zyx, factors, strict=True))
    start = RNG.uniform(0, 255, reduced).astype(np.float32)
    table = RNG.random((256, 4)).astype(np.float32)
    blocks, fine = weighted(shape_zyx)
    level = start.copy()
    _native.fit_level_to_means(
        values, looks, level, factors, 0, (0, reduced[0]), 0.3, table[None], blocks, (2, 2, 2), 1, 1.5
    )
    expected = moved(start, (values, looks[:, 0]), table, fine, factors)
    np.testing.assert_allclose(level, expected, rtol=2e-5, atol=2e-3)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("factors", [(2, 2, 2), (1, 4, 2), (3, 2, 5)])
def test_means_of_values_are_of_each_block_and_those_of_looks_of_the_rows_on_its_diagonals(dtype, factors) -> None:
    largest = np.iinfo(dtype).max
    volume = RNG.integers(0, largest, (7, 9, 11), dtype=dtype, endpoint=True)
    bins = min(1024, largest + 1)
    bins_per_code = (bins - 1) / largest
    table = RNG.random((2, bins, 4)).astype(np.float32)
    shape = _native.box_reduced_shape(volume.shape, factors)
    z, y, x = shape
    values, looks = np.empty(shape, np.float32), np.empty((z, 2, y, x, 4), np.float32)
    _native.sample_means(volume, factors, bins_per_code, table, values, looks)
    for place in np.ndindex(*shape):
        block = volume[tuple(slice(k * f, (k + 1) * f) for k, f in zip(place, factors, strict=True))]
        assert values[place] == pytest.approx(block.mean() * bins_per_code, rel=1e-6)
        z, y, _ = np.ogrid[tuple(slice(n) for n in block.shape)]
        seen = block[np.broadcast_to((z - y) % min(factors[:2]) == 0, block.shape)]
        bin_of = (seen * np.float32(bins_per_code) + 0.5).astype(int)
        np.testing.assert_allclose(looks[place[0], :, place[1], place[2]], table[:, bin_of].mean(axis=1), rtol=1e-5)


@pytest.mark.parametrize("shape_zyx", [(16, 9, 33), (3, 8, 8)])
def test_a_level_fitted_to_values_does_not_depend_on_threads(shape_zyx) -> None:
    volume = RNG.integers(0, 256, shape_zyx).astype(np.uint8)
    found = []
    for threads in (1, 2, 5):
        level = np.full(tuple(-(-n // 2) for n in shape_zyx), 100, np.float32)
        _native.fit_values(volume, level, (2, 2, 2), 255, 4, 1.2, threads)
        found.append(level.tobytes())
    assert len(set(found)) == 1


@pytest.mark.parametrize("wanted", [(0, 2), (3, 5), (7, 10), (9, 10)])
def test_wanted_slices_of_a_fitted_level_are_those_of_all(wanted) -> None:
    volume = RNG.integers(0, 256, (20, 9, 11)).astype(np.uint8)
    table = RNG.random((1, 256, 4)).astype(np.float32)
    blocks, _ = weighted(volume.shape)
    found = []
    for slices in ((0, 10), wanted):
        level = np.full((10, 5, 6), 99, np.float32)
        _native.fit_level(volume, level, (2, 2, 2), 0, slices, 1.0, 0.3, table, blocks, (2, 2, 2), 3, 1.2)
        found.append(level[slice(*wanted)].tobytes())
    assert found[0] == found[1]


@pytest.mark.parametrize("shape_zyx", [(16, 9, 33), (3, 8, 8)])
def test_a_fitted_level_does_not_depend_on_threads(shape_zyx) -> None:
    volume = RNG.integers(0, 256, shape_zyx).astype(np.uint8)
    reduced = tuple(-(-n // 2) for n in shape_zyx)
    start = RNG.uniform(0, 255, reduced).astype(np.float32)
    table = RNG.random((1, 256, 4)).astype(np.float32)
    blocks, _ = weighted(shape_zyx)
    found = []
    for threads in (1, 2, 5):
        level = start.copy()
        _native.fit_level(
            volume, level, (2, 2, 2), 0, (0, reduced[0]), 1.0, 0.3, table, blocks, (2, 2, 2), 4, 1.2, threads
        )
        found.append(level.tobytes())
    assert len(set(found)) == 1
