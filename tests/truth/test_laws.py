"""Laws of light that a picture may not break."""

import numpy as np
import pytest

from volprep.truth.laws import broken_laws

ROUNDING = 2.0**-12


def picture(*, red=0.2, green=0.1, blue=0.0, opacity=0.5):
    rgba = np.tile(np.float32([0.1, 0.2, 0.3, 0.4]), (3, 5, 1))
    rgba[1, 2] = red, green, blue, opacity
    return rgba


def test_a_picture_that_obeys_all_has_nothing_to_say():
    assert not list(broken_laws(picture(), ROUNDING))
    assert not list(broken_laws(picture(red=1.0, opacity=1.0), ROUNDING))


@pytest.mark.parametrize(
    ("broken", "law"),
    [
        (picture(red=np.nan), "a pixel is no finite number"),
        (picture(opacity=np.inf), "a pixel is no finite number"),
        (picture(opacity=1.01), "opacity goes from 0.4 to 1.01"),
        (picture(red=-0.1, green=-0.1, opacity=-0.01), "opacity goes from -0.01 to 0.4"),
        (picture(green=-0.001), "a colour is -0.001"),
        (picture(blue=0.51), "a colour is brighter than its opacity by 0.01"),
    ],
)
def test_each_law_is_told_from_the_others(broken, law):
    assert law in list(broken_laws(broken, ROUNDING))


def test_more_extinction_is_not_less_opaque_but_for_what_early_ends_leave_out():
    fainter, denser = picture(opacity=0.5), picture(opacity=0.499)
    assert list(broken_laws(denser, ROUNDING, fainter)) == ["with more extinction a pixel is less opaque by 0.001"]
    assert not list(broken_laws(denser, ROUNDING, fainter, left_out=0.002))
    assert not list(broken_laws(fainter, ROUNDING, denser))


def test_rounding_breaks_no_law():
    assert not list(broken_laws(picture(opacity=1 + 2.0**-13, red=-(2.0**-13)), ROUNDING))
