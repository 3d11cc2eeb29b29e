"""Light from the viewer where a gradient vanishes."""

import numpy as np
import pytest

from volprep.parts.headlight import soft_slope, softened_cosine
from volprep_formats.package.parts.normals.record import SOFT_SLOPE


def test_light_is_the_cosine_on_steep_places_and_whole_on_flat_ones() -> None:
    forward, squared = np.array([0.0, 0.6, 0.0]), np.array([0.0, 1.0, 1.0])
    np.testing.assert_allclose(softened_cosine(forward, squared, SOFT_SLOPE), [1.0, 0.6, 0.0], atol=SOFT_SLOPE)


def test_light_changes_evenly_while_a_slope_across_the_ray_vanishes() -> None:
    """With a threshold it would jump from 0 to 1 between two of these slopes."""
    across = np.linspace(0.0, 4 * SOFT_SLOPE, 100)
    light = softened_cosine(np.zeros_like(across), across**2, SOFT_SLOPE)
    assert np.abs(np.diff(light)).max() < 0.02
    assert light[25] == pytest.approx(np.sqrt(0.5), abs=0.01)


def test_a_volume_of_one_value_is_lit_without_a_range() -> None:
    np.testing.assert_array_equal(softened_cosine(np.zeros(2), np.zeros(2), 0.0), 1.0)


def test_steps_of_held_normals_are_measured_with_light_that_changes_as_fast_as_theirs() -> None:
    assert soft_slope("volume") < soft_slope("central") == soft_slope("forward") == SOFT_SLOPE
