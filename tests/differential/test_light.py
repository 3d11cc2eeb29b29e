"""Light along rays, its slopes, and levels fitted to level 0, against twins that a student could check by eye."""

import numpy as np
import pytest

from volprep import _native

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
    arguments = (bundle["samples"], bundle["offsets"], bundle["lengths_mm"], 1 / 255, common, target)
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
    residual = native_light(bundle, 1 / 255, common) - target
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
    _native.light_equations(
        bundle["samples"], bundle["offsets"], bundle["lengths_mm"], 1 / 255, common, target, matrix, gradient
    )
    step = 1e-6
    light = native_light(bundle, 1 / 255, common)
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


@pytest.mark.parametrize(
    ("shape_zyx", "factors"), [((9, 7, 11), (2, 2, 2)), ((5, 9, 8), (1, 4, 2)), ((1, 1, 6), (1, 1, 2))]
)
def test_a_fitted_level_moves_as_the_formula_says(shape_zyx, factors) -> None:
    volume = RNG.integers(0, 256, shape_zyx).astype(np.uint8)
    reduced = tuple(-(-n // f) for n, f in zip(shape_zyx, factors, strict=True))
    start = RNG.uniform(0, 255, reduced).astype(np.float32)
    features = RNG.random((256, 3))
    slopes = np.diff(features, axis=0, append=features[-1:])
    own, slope = (features * slopes).sum(1), (slopes * slopes).sum(1)
    product = slopes @ features.T
    blocks = tuple(-(-n // 2) for n in shape_zyx)
    weights = RNG.random(blocks)
    level = start.copy()
    arrays = [np.ascontiguousarray(each[None], np.float32) for each in (own, slope, product, weights)]
    _native.fit_level(volume, level, factors, 0, 1.0, 0.3, *arrays, (2, 2, 2), 1, 1.5)
    spread = [weights_of(n, f) for n, f in zip(shape_zyx, factors, strict=True)]
    field = np.einsum("zk,yj,xi,kji->zyx", *spread, start.astype(float))
    k = np.minimum(field.astype(int), 254)
    fine = np.kron(weights, np.ones((2, 2, 2)))[tuple(slice(n) for n in shape_zyx)]
    force = 0.3 * (volume - field) + fine * (product[k, volume] - own[k] - (field - k) * slope[k])
    stiffness = 0.3 + fine * slope[k]
    pulls = [np.einsum("zk,yj,xi,zyx->kji", *spread, each) for each in (force, stiffness)]
    expected = np.clip(start + 1.5 * pulls[0] / pulls[1], 0, 255)
    np.testing.assert_allclose(level, expected, rtol=2e-5, atol=2e-3)
