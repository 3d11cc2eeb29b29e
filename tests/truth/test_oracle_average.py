"""The mean value along a ray against closed forms and against many samples."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from volprep.kernels import _native

DTYPES = [np.uint8, np.int16, np.uint16, np.float32]


class Found(NamedTuple):
    value: np.ndarray
    bound: np.ndarray


def mean(volume, camera, *, spacing=(1.0, 1.0, 1.0), slope=1.0, intercept=0.0, shape_hw=(1, 1)):
    """The native kernel. The whole volume is the box."""
    extent = tuple(np.array(volume.shape[::-1]) * spacing)
    # inf shows a pixel that nobody wrote.
    found = Found(np.full(shape_hw, np.inf), np.full(shape_hw, np.inf))
    _native.render_projection(volume, slope, intercept, tuple(spacing), extent, camera, "average", *found, threads=1)
    return found


@pytest.mark.parametrize("value", [0.1, -3e4, 255.0])
@pytest.mark.parametrize("direction", [(1, 0, 0), (1, 1, 1), (0.3, -0.7, 0.2)])
def test_of_a_constant_it_is_the_constant_exactly(oracle, value, direction) -> None:
    volume = np.full((9, 7, 12), value, np.float32)
    origin = np.array([6.0, 3.5, 4.5]) - 20.0 * np.array(direction)
    found = mean(volume, oracle.ray(origin, direction, 60))
    assert found.value[0, 0] == float(np.float32(value))
    assert found.bound[0, 0] == 0.0


@settings(max_examples=80)
@given(seed=st.integers(0, 2**32 - 1), shape=st.tuples(*[st.integers(1, 19)] * 3), dtype=st.sampled_from(DTYPES))
def test_it_is_what_many_samples_give(oracle, seed, shape, dtype) -> None:
    rng = np.random.default_rng(seed)
    spacing = tuple(rng.choice([0.3, 1.0, 1.7], 3).tolist())
    volume = rng.integers(0, 256, shape).astype(dtype)
    extent = np.array(shape[::-1]) * spacing
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    direction = (target - origin) / np.linalg.norm(target - origin)
    length = np.linalg.norm(target - origin) * rng.uniform(0.5, 3)
    found = mean(volume, oracle.ray(origin, direction, length), spacing=spacing)
    start, end = oracle.inside_box(origin, direction, length, extent)
    if start >= end:
        assert np.isnan(found.value[0, 0])
        return
    places = start + (np.arange(20_000) + 0.5) / 20_000 * (end - start)
    truth = oracle.trilinear(volume.astype(float), origin + np.multiply.outer(places, direction), spacing).mean()
    # The midpoint rule is this good where a ray has some fifty kinks.
    assert abs(found.value[0, 0] - truth) < 2e-4 * max(np.ptp(volume), 1)
    assert found.bound[0, 0] < 1e-9 * max(np.ptp(volume), 1)


def test_along_voxel_centres_of_a_ramp_it_is_the_mean_of_the_voxels(oracle) -> None:
    volume = np.arange(10, dtype=np.int16)[None, None, :].repeat(3, axis=0).repeat(3, axis=1)
    found = mean(volume, oracle.ray((-1, 1.5, 1.5), (1, 0, 0), 20), slope=-2.0, intercept=7.0)
    assert abs(found.value[0, 0] - (7.0 - 2.0 * 4.5)) <= found.bound[0, 0] < 1e-12


def test_the_view_from_behind_is_the_mirrored_picture() -> None:
    volume = np.random.default_rng(6).integers(0, 256, (11, 20, 17)).astype(np.uint8)
    camera = np.diag([10.0, 11.0, 9.0, 1.0])
    camera[:3, 3] = (8.5, 10.0, 5.5)
    camera[0, 2], camera[2, 0] = 3.0, -2.0
    front = mean(volume, camera, shape_hw=(13, 17))
    back = mean(volume, camera @ np.diag([-1.0, 1.0, -1.0, 1.0]), shape_hw=(13, 17))
    difference = np.abs(front.value - back.value[:, ::-1])
    assert np.isfinite(front.value).sum() > 50
    assert np.nanmax(difference) < 1e-11
