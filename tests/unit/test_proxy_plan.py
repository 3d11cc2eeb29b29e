"""What the plan decides about proxy geometry: the samples in front of what a mesh encloses; what a scene may ask."""

import numpy as np
import pytest
from pydantic import ValidationError

from volprep.parts.proxy.decision import saved_share
from volprep.scene.scene import ProxySettings

FORMS = ["blocks", "merged", "convex", "box"]


@pytest.mark.parametrize("form", FORMS)
def test_nothing_saves_all_and_everything_saves_none(form):
    assert saved_share(np.zeros((3, 4, 5), np.bool_), form) == 1.0
    assert saved_share(np.ones((3, 4, 5), np.bool_), form) == 0.0


def test_samples_in_front_are_counted_from_six_sides():
    occupied = np.zeros((4, 4, 4), np.bool_)
    occupied[1] = True
    # Along z one of four and two of four lie in front, along y and x one of four slices is met at once, the rest never.
    for form in ("blocks", "merged"):
        assert saved_share(occupied, form) == pytest.approx((0.25 + 0.5 + 4 * 0.75) / 6)


def test_tighter_forms_save_more():
    rng = np.random.default_rng(1)
    for _ in range(30):
        occupied = rng.random((5, 6, 7)) < 0.1
        blocks, convex, box = (saved_share(occupied, form) for form in ("blocks", "convex", "box"))
        assert blocks >= convex >= box


@pytest.mark.parametrize("wrong", [{"form": "ball"}, {"block": 0}, {"block": 257}, {"epsilon": 1.0}])
def test_wrong_wishes_are_refused(wrong):
    with pytest.raises(ValidationError):
        ProxySettings.model_validate(wrong)
