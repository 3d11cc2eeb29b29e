"""The native light of columns of voxels against NumPy."""

import numpy as np
import pytest

from volprep.kernels import _native
from volprep.transfer.rays import segments

RED, BLUE, WHITE = (1.0, 0.1, 0.0), (0.0, 0.2, 1.0), (1.0, 1.0, 1.0)
BENT = ([0.0, 40.0, 60.0, 100.0], [RED, BLUE, WHITE, RED], [0.0, 0.8, 0.1, 3.0])
JUMPS = ([20.0, 20.0, 50.0, 50.0, 80.0, 80.0], [RED, BLUE, BLUE, RED, WHITE, RED], [0.0, 2.0, 2.0, 0.3, 0.0, 1.0])
ONE = ([50.0], [WHITE], [0.4])
MANY = (np.linspace(-1, 101, 300), np.random.default_rng(1).random((300, 3)), np.abs(np.sin(np.arange(300))).round(1))
CROWDED = ([0.0, 99.0, 99.0, 99.001, 99.002, 100.0], [RED, BLUE] * 3, [0.5, 0.0, 2.0, 0.0, 3.0, 0.1])
FUNCTIONS = {"bent": BENT, "jumps": JUMPS, "one point": ONE, "many points": MANY, "crowded points": CROWDED}


def fast(columns, spacing_mm, points, *, nearest, brightness=None, threads=1):
    light = np.full((columns.shape[1], 4), np.nan)
    arrays = (np.array(each, dtype=float) for each in points)
    spacings_mm = np.broadcast_to(spacing_mm, columns.shape[1]).astype(float)
    _native.column_light(columns, spacings_mm, nearest, *arrays, light, brightness, threads)
    return light


def slow(columns, spacing_mm, points, *, nearest, brightness=None):
    first = 0
    values, colours, extinctions = (np.array(each, dtype=float) for each in points)
    light, left = np.zeros((columns.shape[1], 3)), np.ones(columns.shape[1])
    for samples, step_mm in segments(columns, spacing_mm, "nearest" if nearest else "linear"):
        shown = np.ones(samples.shape) if brightness is None else brightness[first : first + len(samples)]
        first += len(samples)
        for sample, bright in zip(samples, shown, strict=True):
            through = np.exp(-step_mm * np.interp(sample, values, extinctions))
            colour = np.stack([np.interp(sample, values, channel) for channel in colours.T], axis=-1)
            light += (left * (1 - through) * bright)[:, None] * colour
            left *= through
    return np.column_stack([light, 1 - left])


@pytest.mark.parametrize("nearest", [False, True])
@pytest.mark.parametrize("points", FUNCTIONS.values(), ids=FUNCTIONS.keys())
@pytest.mark.parametrize("voxels", [1, 2, 90])
def test_light_is_that_of_numpy(points, voxels, nearest):
    random = np.random.default_rng(7)
    # Whole values meet jumps and control points.
    columns = np.concatenate([random.uniform(-20, 120, (voxels, 19)), random.integers(-2, 12, (voxels, 20)) * 10], 1)
    expected = slow(columns, 0.7, points, nearest=nearest)
    np.testing.assert_allclose(fast(columns, 0.7, points, nearest=nearest), expected, rtol=1e-12, atol=1e-14)


def test_each_sample_has_its_brightness_and_each_ray_its_spacing():
    random = np.random.default_rng(9)
    columns, brightness = random.uniform(-20, 120, (30, 37)), random.random((30, 37))
    spacing_mm = random.uniform(0.1, 2.0, 37)
    expected = slow(columns, spacing_mm, BENT, nearest=True, brightness=brightness)
    found = fast(columns, spacing_mm, BENT, nearest=True, brightness=brightness)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


def test_light_does_not_depend_on_the_threads():
    columns = np.random.default_rng(8).uniform(-20, 120, (50, 70))
    one, three = (fast(columns, 0.3, MANY, nearest=False, threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(one, three)


@pytest.mark.parametrize(
    ("columns", "values", "light"),
    [((0, 2), [0.0, 1.0], (2, 4)), ((3, 2), [1.0, 0.0], (2, 4)), ((3, 2), [0.0, 1.0], (3, 4))],
    ids=["no voxel", "descending", "light"],
)
def test_what_does_not_fit_is_refused(columns, values, light):
    with pytest.raises(ValueError, match="must"):
        _native.column_light(
            np.zeros(columns), np.ones(2), False, np.array(values), np.zeros((2, 3)), np.zeros(2), np.zeros(light)
        )


@pytest.mark.parametrize(
    ("spacings", "nearest", "brightness"), [(3, True, (3, 2)), (2, False, (3, 2)), (2, True, (2, 2))]
)
def test_spacings_and_brightness_that_do_not_fit_are_refused(spacings, nearest, brightness):
    points = np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(2)
    with pytest.raises(ValueError, match="must"):
        _native.column_light(
            np.zeros((3, 2)), np.ones(spacings), nearest, *points, np.zeros((2, 4)), np.ones(brightness)
        )
