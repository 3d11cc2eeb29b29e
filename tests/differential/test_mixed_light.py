"""The native light of rays on which the media of styles are mixed, against NumPy."""

import numpy as np
import pytest

from volprep.kernels import _native
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.function_table import Table

VEIL = Table(np.array([0.0, 100.0]), np.array([[1.0, 0.1, 0.0], [0.2, 0.9, 0.3]]), np.array([0.01, 0.4]))
STEEP = Table(np.array([40.0, 60.0]), np.array([[0.0, 0.2, 1.0], [1.0, 1.0, 1.0]]), np.array([0.0, 6.0]))
NOTHING = Table(np.array([0.0]), np.array([[1.0, 1.0, 1.0]]), np.array([0.0]))


def between(known: np.ndarray, samples: int) -> Float64Array:
    """Return numbers [place, ray, ...] in the middles of equal segments, linear between places."""
    at = (np.arange(samples) + 0.5) / samples * len(known) - 0.5
    flat = known.reshape(len(known), -1).astype(np.float64)
    found = np.column_stack([np.interp(at, np.arange(len(known)), column) for column in flat.T])
    return found.reshape(samples, *known.shape[1:])


def slow(  # noqa: PLR0917 - as the kernel takes them
    values: Float64Array,
    looks: Float32Array,
    styles: list[Table],
    samples: int,
    length_mm: float,
    brightness: Float64Array | None,
) -> Float64Array:
    shown = np.ones((samples, values.shape[1])) if brightness is None else between(brightness, samples)
    at, factors = between(values, samples), [between(each, samples) for each in looks]
    light, left = np.zeros((values.shape[1], 3)), np.ones(values.shape[1])
    for k in range(samples):
        emitted, extinction = np.zeros((values.shape[1], 3)), np.zeros(values.shape[1])
        for style, factor in zip(styles, factors, strict=True):
            colour, per_mm = style.at(at[k])
            emitted += colour * factor[k, :, :3] * per_mm[:, None]
            extinction += factor[k, :, 3] * per_mm
        behind = left * np.exp(-extinction * length_mm)
        light += ((left - behind) * shown[k] / np.maximum(extinction, 1e-300))[:, None] * emitted
        left = behind
    return np.column_stack([light, 1.0 - left])


def rays(places: int, count: int = 70) -> tuple[Float64Array, Float32Array, Float64Array]:
    random = np.random.default_rng(places)
    weights = random.random((3, places, count, 1)) * random.integers(0, 2, (3, places, count, 1))
    looks = np.concatenate([weights * random.random((3, places, count, 3)), weights], axis=-1).astype(np.float32)
    return random.uniform(-20, 120, (places, count)), looks, random.random((places, count))


def fast(  # noqa: PLR0917 - as the kernel takes them
    values: Float64Array,
    looks: Float32Array,
    samples: int,
    brightness: Float64Array | None = None,
    styles: tuple[Table, ...] = (VEIL, STEEP, NOTHING),
    threads: int = 1,
) -> Float64Array:
    light = np.full((values.shape[1], 4), np.nan)
    _native.mixed_light(values, looks, [each.points for each in styles], samples, 0.3, light, brightness, threads)
    return light


@pytest.mark.parametrize("is_lit", [False, True])
@pytest.mark.parametrize(("places", "samples"), [(1, 1), (1, 3), (2, 5), (40, 13), (40, 160)])
def test_light_is_that_of_numpy(places, samples, is_lit):
    values, looks, brightness = rays(places)
    shown = brightness if is_lit else None
    expected = slow(values, looks, [VEIL, STEEP, NOTHING], samples, 0.3, shown)
    np.testing.assert_allclose(fast(values, looks, samples, shown), expected, rtol=1e-12, atol=1e-13)


def test_one_style_everywhere_is_its_function_alone():
    values, _, brightness = rays(30)
    everywhere = np.ones((1, *values.shape, 4), np.float32)
    alone = np.empty((values.shape[1], 4))
    _native.column_light(values, np.full(values.shape[1], 0.3), True, *VEIL.points, alone, brightness)
    np.testing.assert_allclose(fast(values, everywhere, 30, brightness, (VEIL,)), alone, rtol=1e-13)


def test_the_light_does_not_depend_on_the_number_of_threads():
    values, looks, brightness = rays(50, 333)
    one = fast(values, looks, 77, brightness)
    for threads in (2, 3, 8):
        assert np.array_equal(fast(values, looks, 77, brightness, threads=threads), one)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"styles": (VEIL,)}, "number of styles"),
        ({"samples": 0}, "a sample"),
        ({"looks": np.ones((3, 4, 70, 4), np.float32)}, "shape of values"),
        ({"brightness": np.ones((4, 70))}, "shape of values"),
    ],
)
def test_sizes_that_do_not_fit_are_refused(change, message):
    values, looks, brightness = rays(5)
    arguments = {"looks": looks, "samples": 5, "brightness": brightness} | change
    with pytest.raises(ValueError, match=message):
        fast(values, **arguments)
