"""The native light of rays in straight pieces against the light of each piece, put together with NumPy."""

import numpy as np
import pytest

from volprep.kernels import _native

RED, BLUE, WHITE = (1.0, 0.1, 0.0), (0.0, 0.2, 1.0), (1.0, 1.0, 1.0)
BENT = ([0.0, 40.0, 60.0, 100.0], [RED, BLUE, WHITE, RED], [0.0, 0.8, 0.1, 3.0])
JUMPS = ([20.0, 20.0, 50.0, 50.0, 80.0], [RED, BLUE, BLUE, RED, WHITE], [0.0, 2.0, 2.0, 0.3, 0.0])
EMPTY = ([0.0, 1.0], [WHITE, WHITE], [0.0, 0.0])


def arrays(points):
    return [np.array(each, dtype=float) for each in points]


def fast(rays, pieces, piece_mm, points, threads=1):
    light = np.full((rays.shape[1], 4), np.nan)
    _native.straight_light(rays, pieces, piece_mm, *arrays(points), light, threads)
    return light


def slow(rays, pieces, piece_mm, points):
    places = np.linspace(0, len(rays), pieces + 1) - 0.5
    light = np.empty((rays.shape[1], 4))
    for ray in range(rays.shape[1]):
        ends = np.interp(places, np.arange(len(rays)), rays[:, ray])
        each = np.empty((pieces, 4))
        _native.preintegrate(ends[:-1].copy(), ends[1:].copy(), *arrays(points), piece_mm, each)
        left = np.exp(-piece_mm * np.concatenate([[0], np.cumsum(each[:, 3])]))
        light[ray] = *(-np.diff(left) @ each[:, :3]), 1 - left[-1]
    return light


@pytest.mark.parametrize("points", [BENT, JUMPS, EMPTY], ids=["bent", "jumps", "empty"])
@pytest.mark.parametrize(("samples", "pieces"), [(1, 1), (1, 3), (2, 5), (80, 80), (80, 33), (80, 1), (7, 50)])
def test_light_is_that_of_the_pieces_one_behind_the_other(points, samples, pieces):
    random = np.random.default_rng(9)
    rays = np.concatenate([random.uniform(-20, 120, (samples, 13)), random.integers(0, 6, (samples, 9)) * 20.0], axis=1)
    np.testing.assert_allclose(
        fast(rays, pieces, 0.21, points), slow(rays, pieces, 0.21, points), rtol=1e-11, atol=1e-13
    )


def test_light_does_not_depend_on_the_threads():
    rays = np.random.default_rng(8).uniform(-20, 120, (50, 70))
    one, three = (fast(rays, 31, 0.3, BENT, threads) for threads in (1, 3))
    np.testing.assert_array_equal(one, three)


@pytest.mark.parametrize(
    ("rays", "pieces", "piece_mm", "light"),
    [((0, 2), 1, 1.0, (2, 4)), ((3, 2), 0, 1.0, (2, 4)), ((3, 2), 1, 0.0, (2, 4)), ((3, 2), 1, 1.0, (3, 4))],
    ids=["no sample", "no piece", "no length", "light"],
)
def test_what_does_not_fit_is_refused(rays, pieces, piece_mm, light):
    with pytest.raises(ValueError, match=r"must|expected"):
        _native.straight_light(np.zeros(rays), pieces, piece_mm, *arrays(BENT), np.zeros(light))
