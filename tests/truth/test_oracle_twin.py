"""The oracle against its slow twin: random cells, random transfer functions, random rays, and rays where cells meet."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

TWIN_ROUNDING = 2e-14


def assert_agrees(answer, truth, tolerance):
    assert answer.bound[0, 0] <= tolerance
    assert np.abs(answer.rgba[0, 0] - truth).max() <= answer.bound[0, 0] + TWIN_ROUNDING


def random_scene(oracle, rng, scale):
    shape = tuple(rng.integers(1, 6, 3))
    spacing = rng.choice([0.01, 0.3, 1.0, 1.7], 3)
    volume = rng.integers(0, 256, shape).astype(rng.choice([np.uint8, np.int16, np.uint16, np.float32]))
    count = rng.integers(1, 7)
    values = np.sort(rng.uniform(0, 255, count))
    if count > 2 and rng.random() < 0.5:
        values[1] = values[2]  # a jump
    empty = rng.random(count) < 0.3
    extinctions = np.where(empty, 0.0, rng.uniform(0, scale, count))
    points = [oracle.point(v, e, tuple(rng.uniform(0, 1, 3))) for v, e in zip(values, extinctions, strict=True)]
    return volume, spacing, points


@settings(max_examples=150)
@given(
    seed=st.integers(0, 2**32 - 1),
    depth=st.floats(-3, 2.3).map(lambda power: 10.0**power),
    tolerance=st.floats(-9, -2).map(lambda power: 10.0**power),
    axis=st.sampled_from([None, None, 0, 1, 2]),
)
@example(seed=1, depth=30.0, tolerance=1e-4, axis=None)
def test_random_rays_agree_within_the_bound(oracle, seed, depth, tolerance, axis):
    rng = np.random.default_rng(seed)
    volume, spacing, points = random_scene(oracle, rng, depth)
    extent = np.array(volume.shape[::-1]) * spacing
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    if axis is not None:
        target[axis] = origin[axis]  # parallel to two faces
    length = np.linalg.norm(target - origin) * rng.uniform(0.5, 3)
    answer = oracle.draw(
        volume, points, oracle.ray(origin, target - origin, length), spacing_mm_xyz=spacing, tolerance=tolerance
    )
    truth = oracle.slow_light(volume, points, (origin, target - origin, length), spacing)
    assert_agrees(answer, truth, tolerance)


SPECIAL_RAYS = {
    "along an edge between cells": ((-1, 2.5, 1.5), (1, 0, 0)),
    "in a face between cells": ((-1, 2.5, 0.3), (1, 0, 0.31)),
    "in a face, against the axis": ((1.5, 6.0, 0.2), (0, -1, 0.4)),
    "through corners of cells": ((-0.5, -0.5, -0.5), (1, 1, 1)),
    "through corners, backwards": ((5.5, 5.5, 5.5), (-1, -1, -1)),
    "across the diagonals of faces": ((-0.5, 2.5, -0.5), (1, 0, 1)),
    "nearly in a face": ((-1, 2.5, 1.5), (1, 1e-13, -1e-9)),
    "along the box's surface": ((-1, 0, 0), (1, 0, 0)),
    "in the outer half voxel": ((-1, 0.2, 4.9), (1, 0, 0)),
    "through a corner of the box": ((-1, 0.01, 0), (1, -0.01, 0)),
    "from inside": ((2.2, 2.9, 1.1), (-0.2, 0.5, 0.7)),
}


@pytest.mark.parametrize(("origin", "direction"), SPECIAL_RAYS.values(), ids=SPECIAL_RAYS)
def test_rays_where_cells_meet_agree(oracle, origin, direction):
    volume = np.random.default_rng(7).integers(0, 256, (5, 5, 5)).astype(np.uint8)
    points = [
        oracle.point(30.3, 0.0, (1, 0, 0)),
        oracle.point(90.7, 1.5, (0, 1, 0)),
        oracle.point(90.7, 0.2, (0, 0, 1)),
        oracle.point(200.1, 0.7, (1, 1, 0)),
    ]
    answer = oracle.draw(volume, points, oracle.ray(origin, direction, 12.0), tolerance=1e-9)
    assert_agrees(answer, oracle.slow_light(volume, points, (origin, direction, 12.0)), 1e-9)


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 1, 9), (9, 1, 1), (1, 7, 1), (2, 1, 5), (1, 3, 4)])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, -1), (0.4, 1, 0.7)])
def test_axes_of_one_voxel_work(oracle, shape, direction):
    volume = np.random.default_rng(3).integers(0, 256, shape).astype(np.int16)
    points = [oracle.point(0, 0.1, (1, 0, 0)), oracle.point(255, 0.6, (0, 1, 1))]
    spacing = (0.8, 3.0, 1.1)
    origin = np.array(shape[::-1]) * spacing * 0.45 - np.array(direction) * 20
    answer = oracle.draw(volume, points, oracle.ray(origin, direction, 50), spacing_mm_xyz=spacing, tolerance=1e-10)
    truth = oracle.slow_light(volume, points, (origin, direction, 50), spacing)
    assert truth[3] > 0.01
    assert_agrees(answer, truth, 1e-10)


@pytest.mark.parametrize("spacing", [(0.01, 1, 1), (1, 0.01, 1), (1, 1, 100)])
def test_spacing_of_one_to_a_hundred_works(oracle, spacing):
    volume = np.random.default_rng(5).integers(0, 256, (4, 5, 6)).astype(np.uint16)
    points = [
        oracle.point(20, 0, (1, 0, 0)),
        oracle.point(120, 0.9, (0, 1, 0)),
        oracle.point(120, 0.1, (0, 1, 1)),
        oracle.point(250, 2.0),
    ]
    extent = np.array([6, 5, 4]) * spacing
    for target in ((0.3, 0.4, 0.6), (0.5, 0.5, 0.5), (0.9, 0.1, 0.2)):
        origin = extent * (1.1, 1.2, -0.2)
        direction = extent * target - origin
        length = 2 * np.linalg.norm(direction)
        answer = oracle.draw(
            volume, points, oracle.ray(origin, direction, length), spacing_mm_xyz=spacing, tolerance=1e-8
        )
        assert_agrees(answer, oracle.slow_light(volume, points, (origin, direction, length), spacing), 1e-8)


@pytest.mark.parametrize("shape", [(19, 33, 26), (1, 40, 9), (17, 17, 17)])
@pytest.mark.parametrize("inverted", [False, True], ids=["empty below", "empty above"])
def test_what_is_left_out_because_it_is_empty_changes_nothing(oracle, shape, inverted):
    # A few voxels that shine, just beyond the face of a block of 8 or in a corner, among many that do not.
    rng = np.random.default_rng(9)
    volume = np.zeros(shape, np.float32)
    for _ in range(12):
        volume[tuple(rng.choice([i for i in (0, 1, 7, 9, 15, 17, 25, n - 1) if i < n]) for n in shape)] = 100
    points = [oracle.point(20, 0.0, (1, 0, 0)), oracle.point(90, 0.9, (0, 1, 0)), oracle.point(90, 3.0, (0, 0, 1))]
    if inverted:
        volume = 100 - volume
        points = [oracle.point(100 - p.value, p.extinction_per_mm, p.colour) for p in reversed(points)]
    spacing = np.array([0.7, 1.0, 1.3])
    seen = 0
    for target in np.argwhere(volume == (0 if inverted else 100))[:, ::-1]:
        through = (target + 0.5 + rng.uniform(-0.6, 0.6, 3)) * spacing
        direction = rng.normal(size=3) * (rng.random(3) < 0.8) + (1e-3, 0, 0)
        origin = through - 60 * direction / np.linalg.norm(direction)
        answer = oracle.draw(volume, points, oracle.ray(origin, direction, 120), spacing_mm_xyz=spacing, tolerance=1e-9)
        truth = oracle.slow_light(volume, points, (origin, direction, 120), spacing)
        assert_agrees(answer, truth, 1e-9)
        seen += truth[3] > 0.01
    assert seen >= 3
