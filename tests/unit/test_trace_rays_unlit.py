"""The adjoint of a ray's light, against differences of the light itself."""

import numpy as np
import pytest
from adjoint_rays import SHAPE, SLOPES, SPACING, TABLE, random_lines

from volprep.kernels import _native
from volprep.parts.levels.rays import sample_slices
from volprep.parts.levels.refined import smoothed_slopes


@pytest.fixture
def level():
    return np.random.default_rng(1).uniform(0.2, 0.8, SHAPE).astype(np.float32)


@pytest.fixture
def lines():
    return random_lines()


def light_of(level, lines):
    """The light of rays, by the kernel that fits tables."""
    codes = np.rint(level * 65535).astype(np.uint16)
    return sample_slices(codes, SPACING, lines).light(TABLE)


def sums_of(level, lines, light, weights, threads=0):
    counts = np.diff(sample_slices(np.zeros(SHAPE, np.uint8), SPACING, lines).offsets)
    sums = np.zeros((*SHAPE, 2), np.float32)
    room = np.zeros(_native.trace_room(SHAPE), np.float32)
    spacing = np.array(SPACING[::-1])
    cost = _native.trace_sums(
        level,
        lines.starts_mm_xyz / spacing - 0.5,
        lines.directions_xyz / spacing,
        lines.lengths_mm,
        np.concatenate([[0], np.cumsum(counts)]),
        None,
        TABLE,
        SLOPES,
        light,
        weights,
        room,
        sums,
        threads,
    )
    return cost, sums


def test_the_gradient_is_that_of_differences_of_the_light(level, lines) -> None:
    target = light_of(np.full(SHAPE, 0.4, np.float32), lines)
    weights = np.random.default_rng(3).uniform(0.5, 2.0, 21)
    cost, sums = sums_of(level, lines, target, weights)
    assert cost == pytest.approx((weights[:, None] * (light_of(level, lines) - target) ** 2).sum(), rel=1e-3)
    change = 0.02
    for voxel in [(0, 0, 0), (1, 2, 1), (2, 4, 3), (1, 3, 2)]:
        costs = []
        for sign in (1, -1):
            moved = level.copy()
            moved[voxel] += sign * change
            costs.append((weights[:, None] * (light_of(moved, lines) - target) ** 2).sum())
        slope = (costs[0] - costs[1]) / (2 * change)
        assert 2 * sums[(*voxel, 0)] == pytest.approx(slope, rel=0.02, abs=1e-3 * float(np.abs(sums).max()))


def test_a_step_of_gradient_over_curvature_lowers_the_error(level, lines) -> None:
    target = light_of(np.full(SHAPE, 0.4, np.float32), lines)
    cost, sums = sums_of(level, lines, target, np.ones(21))
    met = sums[..., 1] > 0
    step = np.where(met, sums[..., 0] / np.where(met, sums[..., 1], 1), 0)
    after, _ = sums_of((level - step).astype(np.float32), lines, target, np.ones(21))
    assert 0 < after < 0.9 * cost


def test_threads_do_not_change_a_bit(level, lines) -> None:
    target = light_of(np.full(SHAPE, 0.4, np.float32), lines)
    (cost, one), (again, three) = (sums_of(level, lines, target, np.ones(21), threads) for threads in (1, 3))
    assert cost == again
    assert np.array_equal(one, three)


def test_shapes_that_do_not_fit_are_refused(level, lines) -> None:
    with pytest.raises(ValueError, match="must have one length"):
        sums_of(level, lines, np.zeros((20, 4)), np.ones(21))


def test_slopes_reach_beyond_the_foot_of_a_table() -> None:
    table = np.zeros((11, 4))
    table[6:, 3] = 1.0
    slopes = smoothed_slopes(table, 0.2)[:, 3]
    assert slopes[3] == 0.0
    assert slopes[4] == pytest.approx(2.5)
    assert slopes[9] == 0.0
