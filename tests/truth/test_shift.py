"""How far a picture is shifted against the truth."""

import numpy as np
import pytest
from scipy import ndimage

from volprep.truth.shift import shift_pixels

SHAPE = (41, 53)


def hills(down=0.0, right=0.0):
    """Smooth hills that lie so many pixels below and right, [H, W, 4]."""
    y, x = np.indices(SHAPE, float)
    y, x = y - down, x - right
    light = sum(np.exp(-((y - 7 * k) ** 2 + (x - 9 * k - 5) ** 2) / (6 + k)) for k in range(1, 6))
    return light[..., None] * np.array([0.5, 0.3, 0.2, 0.6])


@pytest.mark.parametrize("shift", [(0.5, 0.0), (0.0, -0.5), (0.3, 0.4)])
def test_a_shift_is_found_with_its_direction_whatever_the_brightness(shift) -> None:
    assert shift_pixels(0.7 * hills(*shift) + 0.1, hills()) == pytest.approx(shift, abs=0.06)


def test_a_blurred_picture_is_not_shifted() -> None:
    assert np.hypot(*shift_pixels(ndimage.gaussian_filter(hills(), (1.2, 1.2, 0)), hills())) < 0.02


def test_a_picture_that_differs_in_something_else_is_not_shifted() -> None:
    other = hills() + np.random.default_rng(1).normal(0, 0.1, (*SHAPE, 1))
    other[:20] *= 0.5
    assert shift_pixels(other, hills()) == (0.0, 0.0)
    assert shift_pixels(0 * hills(), hills()) == (0.0, 0.0)


def test_tiny_pictures_say_nothing() -> None:
    assert shift_pixels(hills(0.5)[10:25, 10:30], hills()[10:25, 10:30]) == (0.0, 0.0)
