"""The oracle against light that is known in closed form."""

import closed_forms
import numpy as np
import pytest

from volprep.truth import phantoms
from volprep_formats.grid import Grid

RED_TO_BLUE = ((0.9, 0.2, 0.1), (0.1, 0.3, 1.0))
# Sampled ramps are exact in float32 only when their values are: 1/8 per voxel.
DIRECTIONS = [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 1, 0), (1, 1, 1), (-0.3, 0.7, 0.2), (1, 1e-9, 0), (2, -1, 1e-3)]


def through_centre(extent, direction):
    """A ray through the middle of the box that begins and ends outside: origin, length, and its length inside."""
    direction = np.array(direction) / np.linalg.norm(direction)
    extent = np.array(extent)
    with np.errstate(divide="ignore"):
        inside = np.min(np.where(direction != 0, extent / np.abs(direction), np.inf))
    reach = 2 * np.linalg.norm(extent)
    return extent / 2 - direction * reach, 2 * reach, inside


def assert_within_bound(answer, truth, tolerance):
    error = np.abs(answer.rgba[0, 0] - truth).max()
    assert answer.bound[0, 0] <= tolerance
    assert error <= answer.bound[0, 0] + 4 * np.finfo(float).eps  # the closed form's own rounding


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("extinction", [1e-6, 0.03, 4.0, 1e6])
def test_a_homogeneous_slab_has_its_colour_times_its_opacity(oracle, direction, extinction):
    volume = np.full((5, 3, 7), 40, np.uint8)
    spacing = (0.5, 2.0, 1.25)
    colour = (0.25, 0.5, 1.0)
    origin, length, inside = through_centre(np.array([7, 3, 5]) * spacing, direction)
    answer = oracle.draw(
        volume, [oracle.point(40, extinction, colour)], oracle.ray(origin, direction, length), spacing_mm_xyz=spacing
    )
    assert_within_bound(answer, closed_forms.layers_light([colour], [extinction], [inside]), 1e-6)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("extinctions", [(0.0, 0.4), (0.4, 0.0), (0.05, 0.06), (3.0, 900.0), (900.0, 3.0)])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-11])
def test_a_ramp_has_the_light_of_a_linear_layer(oracle, direction, extinctions, tolerance):
    spacing = np.array([0.5, 2.0, 1.25])
    shape_zyx = (9, 6, 17)
    extent = np.array(shape_zyx[::-1]) * spacing
    gradient = np.array([0.25, -0.125, 0.5])
    field = closed_forms.ramp(tuple(gradient), 3.0)
    volume = phantoms.sampled(field, Grid.of(shape_zyx, tuple(spacing[::-1])))
    # From one outer plane of voxel centres to another: beyond them the field is not a ramp any more.
    direction = np.array(direction) / np.linalg.norm(direction)
    middle = extent / 2
    reach = np.min(np.divide((extent - spacing) / 2, np.abs(direction), where=direction != 0, out=np.full(3, np.inf)))
    origin = middle - direction * reach
    ends = field(np.array([origin, origin + 2 * reach * direction]))
    points = sorted(
        [oracle.point(ends[0], extinctions[0], RED_TO_BLUE[0]), oracle.point(ends[1], extinctions[1], RED_TO_BLUE[1])]
    )
    answer = oracle.draw(
        volume, points, oracle.ray(origin, direction, 2 * reach), spacing_mm_xyz=spacing, tolerance=tolerance
    )
    assert_within_bound(answer, closed_forms.linear_light(RED_TO_BLUE, extinctions, 2 * reach), tolerance)


@pytest.mark.parametrize("direction", [d for d in DIRECTIONS if d[0] != 0])
@pytest.mark.parametrize("scale", [1e-6, 1e-2, 1.0, 1e3, 1e6])
def test_steps_in_the_transfer_function_make_layers(oracle, direction, scale):
    # A ramp along x over 16 voxels of 1 mm, from 0.5 to 15.5; shells between 2, 5, 5.001, 9, 13, one as thin as 1 µm.
    volume = np.broadcast_to(np.arange(16, dtype=np.float32) + 0.5, (16, 16, 16)).copy()
    steps = [2.0, 5.0, 5.001, 9.0, 13.0]
    extinctions = np.array([0.0, 0.4, 7.0, 0.0, 0.1, 0.9]) * scale
    colours = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.5, 0.5, 0.5), (0, 0, 1), (1, 1, 0.25)]
    points = []
    for i, value in enumerate(steps):
        points += [
            oracle.point(value, extinctions[i], colours[i]),
            oracle.point(value, extinctions[i + 1], colours[i + 1]),
        ]
    direction = np.array(direction) / np.linalg.norm(direction)
    # In the middle of the box, so that every ray goes from x = 0.5 to x = 15.5 or leaves by another side.
    reach = min(7.5 / abs(component) for component in direction if component != 0)
    origin = 8.0 - direction * reach
    ends = np.clip(origin[0] + direction[0] * np.array([0, 2 * reach]), 0.5, 15.5)
    low, high = min(ends), max(ends)
    edges = np.clip([low, *steps, high], low, high)
    order = slice(None) if direction[0] > 0 else slice(None, None, -1)
    lengths = np.diff(edges)[order] / abs(direction[0])
    truth = closed_forms.layers_light(np.array(colours)[order], extinctions[order], lengths)
    answer = oracle.draw(volume, points, oracle.ray(origin, direction, 2 * reach))
    # At 1e6 per mm the place of a step matters to 1e-12 mm, and float64 has 1e-15: a thousandth of 1e-6.
    assert_within_bound(answer, truth, 1e-6)


def test_a_shell_thinner_than_any_step_is_not_missed(oracle):
    volume = np.linspace(0, 100, 33, dtype=np.float32)[None, None, :].copy()
    width = 1e-5  # in value; 3.2e-6 mm on the ray
    points = [
        oracle.point(40, 0),
        oracle.point(40, 3e5, (0.2, 0.4, 0.6)),
        oracle.point(40 + width, 3e5, (0.2, 0.4, 0.6)),
        oracle.point(40 + width, 0),
    ]
    answer = oracle.draw(volume, points, oracle.ray((-1, 0.5, 0.5), (1, 0, 0), 40))
    truth = closed_forms.layers_light([(0.2, 0.4, 0.6)], [3e5], [width * 32 / 100])
    assert truth[3] > 0.5
    assert_within_bound(answer, truth, 1e-6)


def test_a_step_shows_what_is_on_its_side_of_it_only(oracle):
    volume = np.array([10, 20], np.uint8).reshape(1, 1, 2)
    points = [oracle.point(15, 0.0, (1, 0, 0)), oracle.point(15, 50.0, (0, 1, 0))]
    answer = oracle.draw(volume, points, oracle.ray((-1, 0.5, 0.5), (1, 0, 0), 4))
    np.testing.assert_allclose(answer.rgba[0, 0], [0, -np.expm1(-50.0), 0, -np.expm1(-50.0)], atol=1e-6)
