"""Differences as colours."""

import numpy as np
import pytest

from volprep.validation.comparison.colours import coloured, colours, css_colour, gain_for, largest_difference


def test_the_difference_is_that_of_the_worst_channel_with_alpha() -> None:
    first = np.zeros((1, 2, 4))
    second = np.array([[[0.1, 0.0, 0.0, 0.3], [0.2, -0.25, 0.0, 0.0]]])
    np.testing.assert_allclose(largest_difference(first, second), [[0.3, 0.25]], rtol=1e-6)


@pytest.mark.parametrize(("error", "gain"), [(0.0, 256.0), (1 / 256, 256.0), (0.005, 128.0), (0.3, 2.0), (1.0, 1.0)])
def test_the_gain_is_a_power_of_two_that_shows_the_error_unclipped(error, gain) -> None:
    assert gain_for(np.full((4, 5), error)) == gain


def test_one_bad_pixel_in_a_picture_does_not_darken_the_rest() -> None:
    differences = np.full((64, 64), 0.01)
    differences[3, 3] = 1.0
    assert gain_for(differences) == 64.0


def test_no_difference_is_black_and_what_is_beyond_the_gain_has_the_last_colour() -> None:
    shown = coloured(np.array([[0.0, 1 / 8, 0.5]]), 8.0)
    np.testing.assert_array_equal(shown[0], [colours()[0], colours()[255], colours()[255]])
    assert shown[0, 0].max() <= 4


def test_grades_of_difference_rise_in_lightness() -> None:
    lightness = colours().astype(float) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness) > -1.0).all()
    assert lightness[-1] > 200


def test_a_linear_colour_is_written_as_srgb() -> None:
    assert css_colour((0.0, 0.21586050, 1.0)) == "#0080ff"
