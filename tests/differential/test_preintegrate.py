"""The native pre-integration against closed forms, piece by piece, and against brute force."""

from itertools import pairwise

import numpy as np
import pytest
from closed_forms import linear_light
from hypothesis import given
from hypothesis import strategies as st

from volprep.kernels import _native

RED, BLUE, WHITE = (1.0, 0.1, 0.0), (0.0, 0.2, 1.0), (1.0, 1.0, 1.0)
BENT = ([0.0, 40.0, 60.0, 100.0], [RED, BLUE, WHITE, (0.2, 0.9, 0.4)], [0.0, 0.8, 0.1, 3.0])
JUMPS = ([20.0, 20.0, 50.0, 50.0, 80.0], [RED, BLUE, BLUE, RED, WHITE], [0.0, 2.0, 2.0, 0.3, 0.0])


def preintegrate(front, back, points, step_mm, threads=1):
    front, back = np.atleast_1d(np.array(front, dtype=float)), np.atleast_1d(np.array(back, dtype=float))
    values, colours, extinctions = (np.array(each, dtype=float) for each in points)
    light = np.full((len(front), 4), np.nan)
    _native.preintegrate(front, back, values, colours.reshape(-1, 3), extinctions, step_mm, light, threads)
    return light


def slow(front, back, points, step_mm):
    """Closed forms of the pieces between control points, one behind the other."""
    values, colours, extinctions = (np.array(each, dtype=float) for each in points)
    low, high = sorted((front, back))
    cuts = [low, *(value for value in np.unique(values) if low < value < high), high]
    pieces = [pair if front < back else pair[::-1] for pair in pairwise(cuts)]
    through, light, depth = 1.0, np.zeros(3), 0.0
    for near, far in pieces if front < back else pieces[::-1]:
        inside = (near + far) / 2
        upper = int(np.searchsorted(values, inside))
        ends = []
        for value in (near, far):
            if upper in {0, len(values)}:
                i = min(upper, len(values) - 1)
                ends.append((colours[i], extinctions[i]))
                continue
            share = (value - values[upper - 1]) / (values[upper] - values[upper - 1])
            ends.append(
                tuple(each[upper - 1] + share * (each[upper] - each[upper - 1]) for each in (colours, extinctions))
            )
        length = abs(far - near) / (high - low) * step_mm
        (near_colour, near_tau), (far_colour, far_tau) = ends
        rgba = linear_light((near_colour, far_colour), (near_tau, far_tau), length)
        light = light + through * rgba[:3]
        depth += (near_tau + far_tau) / 2 * length
        through = np.exp(-depth)
    return np.append(light, 1 - np.exp(-depth)), depth / step_mm


@pytest.mark.parametrize("points", [BENT, JUMPS], ids=["bent", "jumps"])
@pytest.mark.parametrize("step_mm", [0.01, 1.0, 30.0])
def test_it_is_the_closed_form_of_every_piece(points, step_mm):
    ends = np.random.default_rng(4).uniform(-20, 120, (200, 2))
    found = preintegrate(*ends.T, points, step_mm)
    for (front, back), light in zip(ends, found, strict=True):
        rgba, extinction = slow(front, back, points, step_mm)
        assert light[3] == pytest.approx(extinction, rel=1e-12, abs=1e-15)
        opacity = -np.expm1(-light[3] * step_mm)
        # The closed form itself loses digits where the extinction is nearly constant.
        np.testing.assert_allclose(light[:3] * opacity, rgba[:3], rtol=1e-8, atol=1e-10)


@given(st.floats(-50, 150), st.floats(-50, 150), st.floats(1e-6, 1e6), st.floats(0, 1e9))
def test_colours_stay_between_those_of_the_points_however_stiff_it_is(front, back, step_mm, extinction):
    points = ([0.0, 50.0, 50.0, 100.0], [(0.2, 0.2, 0.2), (0.8, 0.8, 0.8)] * 2, [0.0, extinction, 1e-9, extinction])
    light = preintegrate(front, back, points, step_mm)[0]
    assert np.isfinite(light).all()
    assert (light[:3] >= 0.2 - 1e-9).all()
    assert (light[:3] <= 0.8 + 1e-9).all()
    assert 0 <= light[3] <= extinction * (1 + 1e-12) + 1e-9


def test_what_is_in_front_hides_what_is_behind():
    opaque = ([0.0, 50.0, 50.0, 100.0], [RED, RED, BLUE, BLUE], [1e4] * 4)
    light = preintegrate([0.0, 100.0], [100.0, 0.0], opaque, 1.0)
    np.testing.assert_allclose(light[:, :3], [RED, BLUE], atol=1e-12)


def test_where_nothing_absorbs_the_colour_is_the_plain_mean():
    light = preintegrate([0.0, 0.0], [10.0, 5.0], ([0.0, 10.0], [(0, 0, 0), WHITE], [0.0, 0.0]), 1.0)
    np.testing.assert_allclose(light, [[0.5, 0.5, 0.5, 0.0], [0.25, 0.25, 0.25, 0.0]])


def test_segments_without_a_change_are_the_function_and_at_a_jump_the_mean_of_both_sides():
    light = preintegrate([20.0, 35.0, 50.0, 65.0, -5.0, 99.0], [20.0, 35.0, 50.0, 65.0, -5.0, 99.0], JUMPS, 7.0)
    np.testing.assert_allclose(light[:, 3], [1.0, 2.0, 1.15, 0.15, 0.0, 0.0])
    np.testing.assert_allclose(light[0, :3], (np.array(RED) + BLUE) / 2)


def test_both_directions_have_one_opacity_and_two_colours():
    ends = np.random.default_rng(1).uniform(-20, 120, (100, 2))
    there, back = preintegrate(*ends.T, BENT, 2.0), preintegrate(*ends.T[::-1], BENT, 2.0)
    np.testing.assert_allclose(there[:, 3], back[:, 3], rtol=1e-12)
    assert np.abs(there[:, :3] - back[:, :3]).max() > 0.1


def test_the_number_of_threads_does_not_show():
    ends = np.random.default_rng(2).uniform(-20, 120, (1001, 2))
    np.testing.assert_array_equal(preintegrate(*ends.T, BENT, 2.0, 1), preintegrate(*ends.T, BENT, 2.0, 3))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"step_mm": 0.0}, "step_mm is 0"),
        ({"step_mm": float("inf")}, "step_mm is inf"),
        ({"back": np.zeros(3)}, "front, back and light must have one length"),
        ({"values": np.array([1.0, 0.0])}, "values must ascend"),
        ({"extinctions_per_mm": np.zeros(3)}, "must have one length, at least 1"),
        ({"threads": -1}, "threads is -1"),
    ],
)
def test_what_does_not_fit_is_refused(change, message):
    fitting = {
        "front": np.zeros(2),
        "back": np.zeros(2),
        "values": np.array([0.0, 1.0]),
        "colours": np.zeros((2, 3)),
        "extinctions_per_mm": np.zeros(2),
        "step_mm": 1.0,
        "light": np.zeros((2, 4)),
    }
    _native.preintegrate(**fitting)
    with pytest.raises(ValueError, match=message):
        _native.preintegrate(**fitting | change)
