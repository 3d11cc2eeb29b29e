"""The oracle on labels, which are constant in their voxels: exact but for rounding, and honest about faces."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.truth.test_oracle_lit import unit_gradients

ROUNDING = 2e-14


def voxel_by_voxel(oracle, volume, points, ray, spacing):
    """Light along a ray, composited over the pieces between all faces that it meets."""
    origin, direction, length = np.array(ray[0]), np.array(ray[1]) / np.linalg.norm(ray[1]), ray[2]
    shape_xyz = np.array(volume.shape[::-1])
    faces = [np.array([0.0, length])]
    for axis in np.flatnonzero(direction):
        faces += [(np.arange(shape_xyz[axis] + 1) * spacing[axis] - origin[axis]) / direction[axis]]
    places = np.unique(np.clip(np.concatenate(faces), 0, length))
    light, through = np.zeros(3), 1.0
    for begin, end in pairwise(places):
        index = np.floor((origin + direction * (begin + end) / 2) / spacing).astype(int)
        if (index < 0).any() or (index >= shape_xyz).any():
            continue
        value = np.array([float(volume[tuple(index[::-1])])])
        # At a jump the value belongs to the side above.
        segment = int(np.searchsorted([p.value for p in points], value[0], side="right"))
        extinction = oracle.classify(points, segment, value, [p.extinction_per_mm for p in points])[0]
        colour = oracle.classify(points, segment, value, [p.colour for p in points])[0]
        opacity = -np.expm1(-extinction * (end - begin))
        light += through * opacity * colour
        through *= 1 - opacity
    return np.array([*light, 1 - through])


@settings(max_examples=150)
@given(
    seed=st.integers(0, 2**32 - 1),
    depth=st.floats(-3, 3).map(lambda power: 10.0**power),
    axis=st.sampled_from([None, None, 0, 1, 2]),
)
def test_random_rays_agree_with_voxels_one_by_one(oracle, seed, depth, axis):
    rng = np.random.default_rng(seed)
    shape, spacing = rng.integers(1, 20, 3), rng.choice([0.01, 0.3, 1.0, 1.7], 3)
    # Mostly background, so that whole blocks are left out.
    volume = rng.integers(0, 9, shape) * (rng.random(shape) < 0.3)
    volume = volume.astype(rng.choice([np.uint8, np.int16, np.float32]))
    values = np.sort(rng.choice([0.5, 1.0, 2.5, 3.0, 6.5], 4))
    points = [oracle.point(0.5, 0.0)]
    points += [oracle.point(value, rng.uniform(0, depth), tuple(rng.uniform(0, 1, 3))) for value in values]
    extent = shape[::-1] * spacing
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    if axis is not None:
        target[axis] = origin[axis]  # parallel to faces
    length = np.linalg.norm(target - origin) * rng.uniform(0.5, 3)
    camera = oracle.ray(origin, target - origin, length)
    answer = oracle.draw(volume, points, camera, spacing_mm_xyz=spacing, nearest=True)
    truth = voxel_by_voxel(oracle, volume, points, (origin, target - origin, length), spacing)
    assert answer.bound[0, 0] <= 1e-6
    assert np.abs(answer.rgba[0, 0] - truth).max() <= answer.bound[0, 0] + ROUNDING


@pytest.mark.parametrize("numbers", [(1, 2), (2, 1)])
def test_a_lit_label_is_as_bright_as_the_slope_of_its_extinction_lets_it_whatever_its_number(oracle, numbers):
    rng = np.random.default_rng(3)
    first, second = numbers
    volume = rng.choice(np.array([0, first, second], np.uint8), (5, 6, 7))
    extinctions = {0: 0.0, first: 0.9, second: 0.4}
    colours = {0: (0.0, 0.0, 0.0), first: (1.0, 0.5, 0.2), second: (0.1, 0.8, 0.6)}
    points = [
        oracle.point(value + side, extinctions[value], colours[value]) for value in (0, 1, 2) for side in (-0.5, 0.5)
    ]
    spacing, origin, direction = (1.0, 0.7, 1.3), np.array([-1.0, 0.9, 1.1]), np.array([1.0, 0.31, 0.53])
    lit = oracle.draw(
        volume,
        points,
        oracle.ray(origin, direction, 30.0),
        spacing_mm_xyz=spacing,
        nearest=True,
        kernel="sobel",
        tolerance=1e-9,
    )
    lut = np.array([extinctions[value] for value in (0, 1, 2)])
    normals = unit_gradients(lut[volume], "sobel", spacing)
    given = oracle.draw(
        volume,
        points,
        oracle.ray(origin, direction, 30.0),
        spacing_mm_xyz=spacing,
        nearest=True,
        normals=normals.astype(np.float32),
        tolerance=1e-9,
    )
    # Samples so close that a voxel has hundreds.
    unit, step = direction / np.linalg.norm(direction), 1e-3
    at = np.floor((origin + np.arange(step / 2, 30.0, step)[:, None] * unit) / spacing).astype(int)
    z, y, x = at[(at >= 0).all(1) & (at < volume.shape[::-1]).all(1)].T[::-1]
    along = normals[z, y, x] @ unit
    shade = np.sqrt((along**2 + 1e-4) / ((normals[z, y, x] ** 2).sum(-1) + 1e-4))
    depth = lut[volume[z, y, x]] * step
    weight = np.exp(-(np.cumsum(depth) - depth)) * -np.expm1(-depth)
    truth = (weight * shade) @ np.array([colours[value] for value in (0, 1, 2)])[volume[z, y, x]]
    np.testing.assert_allclose(lit.rgba[0, 0, :3], truth, atol=1e-3)
    np.testing.assert_allclose(given.rgba, lit.rgba, atol=1e-6)
    assert lit.bound[0, 0] < 1e-8


def test_one_label_is_a_slab(oracle):
    volume = np.zeros((3, 3, 3), np.uint8)
    volume[1, 1, 1] = 7
    points = [oracle.point(6.5, 0.0), oracle.point(6.5, 0.8), oracle.point(7.5, 0.8), oracle.point(7.5, 0.0)]
    camera = oracle.ray((-1.0, 2.1, 1.7), (1, 0, 0), 9.0)
    answer = oracle.draw(volume, points, camera, spacing_mm_xyz=(2.0, 2.0, 1.0), nearest=True)
    assert answer.rgba[0, 0, 3] == pytest.approx(1 - np.exp(-0.8 * 2.0), abs=1e-14)
    # Half of a trilinear tent of extinction is seen only where it reaches 6.5.
    assert oracle.draw(volume, points, camera, spacing_mm_xyz=(2.0, 2.0, 1.0)).rgba[0, 0, 3] < 0.2


@pytest.mark.parametrize(("origin", "certain"), [((-1, 2.0, 1.3), False), ((-1, 2.0 + 1e-9, 1.3), True)])
def test_a_ray_within_a_face_says_that_it_cannot_know(oracle, origin, certain):
    volume = np.zeros((3, 3, 3), np.uint8)
    volume[:, 2] = 1
    points = [oracle.point(0.3, 0.0), oracle.point(0.3, 2.0)]
    answer = oracle.draw(volume, points, oracle.ray(origin, (1, 0, 0), 9.0), nearest=True)
    assert (answer.bound[0, 0] < 1e-6) == certain
