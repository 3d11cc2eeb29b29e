"""Errors over seen pixels, and the light that thin things keep."""

import numpy as np
import pytest
from scipy import ndimage

from volprep.truth.kept_light import thin_things
from volprep.truth.metrics import picture_error
from volprep.truth.seen import in_8_bits, seen_error, seen_flip
from volprep.validation.seen import seen_numbers

SIZE = 96


def vessel(opacity=0.44, half_width=1.0, size=SIZE):
    """A straight vessel on nothing, premultiplied, [H, W, 4]."""
    rows = np.abs(np.arange(size) - (size - 1) / 2)
    picture = np.zeros((size, size, 4))
    picture[rows < half_width, 8:-8] = opacity * np.array([0.9, 0.5, 0.4, 1.0])
    return picture


def spread(picture, rows):
    """The same light over more rows."""
    return sum(np.roll(picture, k - rows // 2, axis=0) for k in range(rows)) / rows


def test_what_is_not_seen_dilutes_no_error():
    truth, wrong = vessel(), 0.5 * vessel()
    padded = [np.pad(each, ((SIZE, SIZE), (SIZE, SIZE), (0, 0))) for each in (wrong, truth)]
    assert picture_error(*padded).rmse == pytest.approx(picture_error(wrong, truth).rmse / 3)
    assert seen_error(*padded).rmse == pytest.approx(seen_error(wrong, truth).rmse)
    assert seen_error(wrong, truth).share == pytest.approx(2 * (SIZE - 16) / SIZE**2)


def test_a_pixel_is_seen_if_either_picture_shows_more_than_half_a_step_of_8_bits():
    truth, picture = np.zeros((20, 21, 4)), np.zeros((20, 21, 4))
    truth[0, 0, 3], truth[0, 1, 0], picture[0, 2, 3] = 0.51 / 255, 0.51 / 255, 0.51 / 255
    truth[1, :] = 0.49 / 255
    assert seen_error(picture, truth).share == pytest.approx(3 / 420)


def test_pixels_off_by_more_than_ten_steps_over_either_background_are_counted():
    truth = np.full((10, 10, 4), 0.5)
    wrong = truth.copy()
    wrong[0, :3, 3] = 0.6  # shows over white only
    wrong[1, :2, 0] = 0.57  # 11 of 255 in sRGB
    wrong[2, :, 0] = 0.51  # 2 of 255
    assert seen_error(wrong, truth).off == pytest.approx(0.05)


def test_flip_counts_seen_pixels_only():
    truth, wrong = vessel(), 0.5 * vessel()
    padded = [np.pad(each, ((40, 40), (40, 40), (0, 0))) for each in (wrong, truth)]
    assert seen_flip(*padded).black == pytest.approx(seen_flip(wrong, truth).black, rel=0.02)
    assert seen_flip(wrong, truth).black > 0.2


def test_pictures_without_a_seen_pixel_have_no_error():
    nothing = np.zeros((12, 13, 4))
    assert seen_error(nothing, nothing).rmse == 0.0
    assert seen_flip(nothing, nothing).white == 0.0
    assert thin_things(nothing, nothing, 4.0) == ()


def test_a_vessel_keeps_all_its_light_if_nothing_changes_and_if_it_is_spread_over_two_voxels():
    for picture in (vessel(), spread(vessel(), 4)):
        (thing,) = thin_things(picture, vessel(), 4.0)
        assert thing.kept == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("kept", [0.0, 0.5, 0.9])
def test_a_vessel_at_part_of_its_opacity_keeps_that_part(kept):
    (thing,) = thin_things(kept * vessel(), vessel(), 4.0)
    assert thing.kept == pytest.approx(kept, abs=0.01)
    assert thing.light == pytest.approx(2 * (SIZE - 16) * 0.44 * 0.7, rel=0.01)


def test_each_vessel_is_measured_by_itself_and_the_least_kept_comes_first():
    one = np.roll(vessel(), -20, axis=0)
    other = np.roll(vessel(), 20, axis=0)
    first, second = thin_things(one + 0.25 * other, one + other, 4.0)
    assert (first.kept, second.kept) == (pytest.approx(0.25, abs=0.01), pytest.approx(1.0, abs=0.01))
    assert first.rows == (67, 69)


def test_a_change_of_the_background_is_not_the_vessels():
    haze = np.broadcast_to(0.2, (SIZE, SIZE, 4))
    (thing,) = thin_things(haze + 0.1 + 0.5 * vessel(), haze + vessel(), 4.0)
    assert thing.kept == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("kept", [0.0, 0.5, 1.0])
def test_a_body_that_becomes_darker_takes_nothing_from_a_vessel_in_the_air_beside_it(kept):
    bodies = np.zeros((SIZE, SIZE, 4))
    bodies[:36], bodies[-36:] = 0.8, 0.8
    darker = np.where(bodies > 0, bodies - 0.05, 0.0)
    (thing,) = thin_things(darker + kept * vessel(), bodies + vessel(), 4.0)
    assert thing.kept == pytest.approx(kept, abs=0.02)
    assert thing.within < 0.02


def test_kept_light_is_known_less_well_where_the_background_changes_by_chance():
    rng = np.random.default_rng(2)
    haze, noise = np.full((SIZE, SIZE, 1), 0.3), np.kron(0.05 * rng.standard_normal((24, 24, 1)), np.ones((4, 4, 1)))
    off, within = [], []
    for shift in range(0, 96, 12):
        (thing,) = thin_things(haze + np.roll(noise, shift, 0) + 0.5 * vessel(), haze + vessel(), 4.0)
        off.append(thing.kept - 0.5)
        within.append(thing.within)
    assert np.std(off) == pytest.approx(np.mean(within), rel=0.6)


def test_kept_light_of_lines_on_a_body_without_other_background_is_uncertain_by_the_change_of_the_body():
    body = np.zeros((SIZE, SIZE, 4))
    body[36:-36, 4:-4] = 0.5
    lines = body + 0.3 * (vessel() > 0)
    (sure,) = thin_things(lines, lines, 8.0)
    (thing,) = thin_things(0.95 * lines, lines, 8.0)
    assert (sure.kept, sure.within) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-6))
    assert thing.kept < 0.7
    assert thing.kept + thing.within > 0.9
    (lost,) = thin_things(body, lines, 8.0)
    assert lost.kept + lost.within < 0.5


def rough_body(lower=0.0):
    """A body whose outline is soft and rough, and may lie lower; the share of each pixel that it fills."""
    rough = ndimage.gaussian_filter(np.random.default_rng(0).standard_normal((SIZE, SIZE)), 0.7)
    rows, columns = np.mgrid[:SIZE, :SIZE]
    below = (rows - 60 - lower - 0.5 * (columns - 48)) / 2
    share = np.clip(below + 0.3 * rough / rough.std(), 0.0, 1.0)
    return np.repeat(share[..., None], 4, axis=-1)


@pytest.mark.parametrize("width", [2.0, 4.0])
def test_the_corners_of_a_rough_outline_are_no_thin_things(width):
    """They counted, and kept -2.0 and -1.8 where the outline is 0.4 pixels lower."""
    assert thin_things(rough_body(lower=0.4), rough_body(), width) == ()


@pytest.mark.parametrize("shape", ["beside it", "out of it", "before it"])
@pytest.mark.parametrize("kept", [0.0, 0.5, 1.0])
def test_a_vessel_at_a_body_with_a_rough_outline_counts(shape, kept):
    rows, columns = np.mgrid[:SIZE, :SIZE]
    above = 60 + 0.5 * (columns - 48) - rows
    inside = {
        "beside it": (above > 3) & (above < 5),
        "out of it": (above > 0) & (above < 40) & (np.abs(columns - 48) < 1.5),
        "before it": (above > -20) & (above < -18),
    }[shape]
    body = rough_body() * (0.4 if shape == "before it" else 1.0)
    truth = np.where(inside[..., None], np.maximum(body, 0.8), body)
    picture = body + kept * (truth - body)
    assert thin_things(picture, truth, 4.0)[0].kept == pytest.approx(kept, abs=0.1)


def test_what_is_wider_than_the_width_is_no_thin_thing():
    assert thin_things(0 * vessel(half_width=6), vessel(half_width=6), 4.0) == ()
    assert len(thin_things(0 * vessel(half_width=6), vessel(half_width=6), 16.0)) == 1


def test_faint_and_short_things_do_not_count():
    assert thin_things(0 * vessel(0.06), vessel(0.06), 4.0) == ()
    short = vessel()
    short[:, 12:] = 0
    assert thin_things(0 * short, short, 4.0) == ()


def test_rounding_to_the_target_is_no_flip():
    # A dark gradient: half a step of linear light is several of sRGB there.
    truth = np.zeros((40, 40, 4))
    truth[..., :3] = np.linspace(0.002, 0.02, 40)[:, None]
    truth[..., 3] = 1.0
    drawn = in_8_bits(truth)
    assert seen_flip(drawn, truth).black > 0.03
    assert seen_numbers(drawn, truth, (), is_of_target=True).flip == 0.0
    brighter = np.minimum(drawn + 1 / 255, 1.0)
    assert seen_numbers(brighter, truth, (), is_of_target=True).flip > 0.03


def test_a_flat_surface_may_round_either_way_and_no_further():
    truth = np.full((40, 40, 4), 93.499 / 255)
    drawn = np.full((40, 40, 4), 94 / 255)
    assert seen_flip(drawn, in_8_bits(truth)).black > 0.01
    assert seen_numbers(drawn, truth, (), is_of_target=True).flip < 0.001
    further = np.full((40, 40, 4), 95 / 255)
    assert seen_numbers(further, truth, (), is_of_target=True).flip > 0.01
