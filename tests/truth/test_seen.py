"""Errors over seen pixels, and the light that thin things keep."""

from unittest.mock import patch

import numpy as np
import pytest
from scipy import ndimage

from volprep.truth.contrast import contrast_loss
from volprep.truth.kept_contrast import kept_contrast
from volprep.truth.kept_light import lost_things, small_things
from volprep.truth.metrics import picture_error
from volprep.truth.opening import disk_of, opened
from volprep.truth.seen import in_8_bits, seen_error, seen_flip
from volprep.validation.comparison.seen import seen_numbers

SIZE = 96


def vessel(opacity=0.44, half_width=1.0, size=SIZE):
    """A straight vessel on nothing, premultiplied, [H, W, 4]."""
    rows = np.abs(np.arange(size) - (size - 1) / 2)
    picture = np.zeros((size, size, 4))
    picture[rows < half_width, 8:-8] = opacity * np.array([0.9, 0.5, 0.4, 1.0])
    return picture


def bright_things(picture, truth, width, *, spreads=True):
    """Things of the brightness alone, of a coarse level; a vessel is also of another colour than the air."""
    return [thing for thing in small_things(picture, truth, width, spreads=spreads) if thing.signal == "bright"]


def crowd(seed):
    """A grainy body with vessels around it, [H, W, 4], in the middle of an empty picture."""
    chance = np.random.default_rng(seed)
    picture = np.zeros((SIZE * 2, SIZE * 2, 4))
    picture[60:130, 50:120] = 0.3 + 0.2 * ndimage.gaussian_filter(chance.random((70, 70, 1)), (1, 1, 0)) + 0.1
    for row, column in chance.integers(56, 134, (8, 2)):
        picture[row, column - 8 : column + 8] = 0.2 + 0.7 * chance.random()
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


@pytest.mark.parametrize("lit", [False, True])
@pytest.mark.parametrize("width", [3.0, 7.0])
def test_pixels_far_from_all_that_is_shown_change_no_kept_light(width, lit):
    truth = crowd(1)
    picture = 0.9 * spread(truth, 2) + 0.02 * crowd(2)
    found = small_things(picture, truth, width, lit=lit)
    with patch("volprep.truth.kept_light.part_around", lambda *_: (slice(0, None), slice(0, None))):
        whole = small_things(picture, truth, width, lit=lit)
    assert len(found) > 3
    for one, other in zip(found, whole, strict=True):
        assert (one.rows, one.columns, one.signal) == (other.rows, other.columns, other.signal)
        assert (one.kept, one.within, one.light) == pytest.approx((other.kept, other.within, other.light), abs=1e-6)


def test_pixels_beyond_the_reach_of_flip_change_nothing():
    faint = 0.0018 * np.random.default_rng(4).random((SIZE * 2, SIZE * 2, 4))  # less than is seen
    truth, picture = np.maximum(crowd(1), faint), np.maximum(crowd(3), faint[::-1])
    with patch("volprep.truth.metrics.part_around", lambda *_: (slice(0, None), slice(0, None))):
        whole = seen_flip(picture, truth)
    assert seen_flip(picture, truth) == whole


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
    assert small_things(nothing, nothing, 4.0) == ()


def test_a_vessel_keeps_all_its_light_if_nothing_changes_and_if_it_is_spread_over_two_voxels():
    for picture in (vessel(), spread(vessel(), 4)):
        (thing,) = bright_things(picture, vessel(), 4.0)
        assert thing.kept == pytest.approx(1.0, abs=0.01)


def test_the_finest_level_spreads_no_light_over_two_voxels():
    (thing,) = bright_things(spread(vessel(), 4), vessel(), 4.0, spreads=False)
    assert thing.kept_at_most == pytest.approx(0.5, abs=0.01)


def test_a_third_of_a_step_of_8_bits_all_around_is_no_loss_of_a_faint_thing_at_the_finest_level():
    haze = np.full((SIZE, SIZE, 4), 0.2)
    truth = haze + 0.3 * vessel(half_width=2.0)
    rng = np.random.default_rng(4)
    wrong = truth - np.kron(rng.uniform(0.0, 0.003, (12, 12, 1)), np.ones((8, 8, 1)))
    of_level, of_finest = (bright_things(wrong, truth, 12.0, spreads=each)[0] for each in (True, False))
    assert of_finest.kept == pytest.approx(1.0, abs=0.05)
    assert of_finest.within < 0.4 * of_level.within
    (lost,) = bright_things(haze + 0.7 * (truth - haze) + wrong - truth, truth, 12.0, spreads=False)
    assert lost.kept_at_most < 0.75


@pytest.mark.parametrize("spreads", [True, False])
@pytest.mark.parametrize("kept", [0.0, 0.5, 0.9])
def test_a_vessel_at_part_of_its_opacity_keeps_that_part(kept, spreads):
    (thing,) = bright_things(kept * vessel(), vessel(), 4.0, spreads=spreads)
    assert thing.kept == pytest.approx(kept, abs=0.01)
    assert thing.light == pytest.approx(2 * (SIZE - 16) * 0.44 * 0.7, rel=0.01)


def test_each_vessel_is_measured_by_itself_and_the_least_kept_comes_first():
    one = np.roll(vessel(), -20, axis=0)
    other = np.roll(vessel(), 20, axis=0)
    first, second = bright_things(one + 0.25 * other, one + other, 4.0)
    assert (first.kept, second.kept) == (pytest.approx(0.25, abs=0.01), pytest.approx(1.0, abs=0.01))
    assert first.rows == (67, 69)


def test_a_change_of_the_background_is_not_the_vessels():
    haze = np.broadcast_to(0.2, (SIZE, SIZE, 4))
    (thing,) = bright_things(haze + 0.1 + 0.5 * vessel(), haze + vessel(), 4.0)
    assert thing.kept == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("kept", [0.0, 0.5, 1.0])
def test_a_body_that_becomes_darker_takes_nothing_from_a_vessel_in_the_air_beside_it(kept):
    bodies = np.zeros((SIZE, SIZE, 4))
    bodies[:36], bodies[-36:] = 0.8, 0.8
    darker = np.where(bodies > 0, bodies - 0.05, 0.0)
    (thing,) = bright_things(darker + kept * vessel(), bodies + vessel(), 4.0)
    assert thing.kept == pytest.approx(kept, abs=0.02)
    assert thing.within < 0.02


def test_kept_light_is_known_less_well_where_the_background_changes_by_chance():
    rng = np.random.default_rng(2)
    haze, noise = np.full((SIZE, SIZE, 1), 0.3), np.kron(0.05 * rng.standard_normal((24, 24, 1)), np.ones((4, 4, 1)))
    off, within = [], []
    for shift in range(0, 96, 12):
        (thing,) = bright_things(haze + np.roll(noise, shift, 0) + 0.5 * vessel(), haze + vessel(), 4.0)
        off.append(thing.kept - 0.5)
        within.append(thing.within)
    assert np.std(off) == pytest.approx(np.mean(within), rel=0.6)


def test_kept_light_of_lines_on_a_body_without_other_background_is_uncertain_by_the_change_of_the_body():
    body = np.zeros((SIZE, SIZE, 4))
    body[36:-36, 4:-4] = 0.5
    lines = body + 0.3 * (vessel() > 0)
    (sure,) = bright_things(lines, lines, 8.0)
    (thing,) = bright_things(0.95 * lines, lines, 8.0)
    assert (sure.kept, sure.within) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-6))
    assert thing.kept < 0.7
    assert thing.kept + thing.within > 0.9
    (lost,) = bright_things(body, lines, 8.0)
    assert lost.kept + lost.within < 0.5


def rough_body(lower=0.0):
    """A body whose outline is soft and rough, and may lie lower; the share of each pixel that it fills."""
    rough = ndimage.gaussian_filter(np.random.default_rng(0).standard_normal((SIZE, SIZE)), 0.7)
    rows, columns = np.mgrid[:SIZE, :SIZE]
    below = (rows - 60 - lower - 0.5 * (columns - 48)) / 2
    share = np.clip(below + 0.3 * rough / rough.std(), 0.0, 1.0)
    return np.repeat(share[..., None], 4, axis=-1)


@pytest.mark.parametrize("width", [2.0, 4.0])
def test_the_corners_of_a_rough_outline_are_no_small_things(width):
    """They counted, and kept -2.0 and -1.8 where the outline is 0.4 pixels lower."""
    assert small_things(rough_body(lower=0.4), rough_body(), width) == ()


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
    assert small_things(picture, truth, 4.0)[0].kept == pytest.approx(kept, abs=0.1)


@pytest.mark.parametrize("diameter", [1, 2, 3, 4, 7.2])
def test_an_opening_is_that_of_scipy(diameter):
    values = np.random.default_rng(3).random((23, 17)).astype(np.float32)
    expected = ndimage.grey_opening(values, footprint=disk_of(diameter))
    inside = (slice(3, -3), slice(3, -3))  # disks of even size lie otherwise on the border
    np.testing.assert_array_equal(opened(values, disk_of(diameter))[inside], expected[inside])


def test_what_is_wider_than_the_width_is_no_thin_thing():
    assert small_things(0 * vessel(half_width=6), vessel(half_width=6), 4.0) == ()
    assert len(bright_things(0 * vessel(half_width=6), vessel(half_width=6), 16.0)) == 1


def test_faint_things_do_not_count_and_short_ones_are_small():
    assert small_things(0 * vessel(0.06), vessel(0.06), 4.0) == ()
    short = vessel()
    short[:, 12:] = 0
    (thing,) = bright_things(0 * short, short, 4.0)
    assert not thing.is_thin
    assert thing.kept == pytest.approx(0.0, abs=0.01)


def scene(name):
    """A thing on its background and the background alone: a nodule, a lesion, a fracture, a vessel on a wall."""
    rows, columns = np.mgrid[:SIZE, :SIZE]
    noise = 0.02 * np.random.default_rng(5).standard_normal((SIZE, SIZE, 1))
    body = np.where(np.hypot(rows - 48, columns - 48)[..., None] < 40, np.array([0.5, 0.4, 0.3, 0.9]) + noise, 0.0)
    ball, line = np.hypot(rows - 40, columns - 52) < 3, (np.abs(rows - 50) < 1) & (np.abs(columns - 48) < 25)
    inside, colour = {
        "nodule in the air": (np.hypot(rows - 4, columns - 6) < 2, (0.6, 0.5, 0.4, 0.7)),
        "nodule": (ball, (0.8, 0.7, 0.6, 1.0)),
        "lesion of another colour": (ball, (0.6, 0.3, 0.3, 0.9)),
        "fracture": (line, (0.2, 0.15, 0.1, 0.8)),
        "vessel on a wall": (line, (0.62, 0.3, 0.28, 0.9)),
    }[name]
    return np.where(inside[..., None], np.array(colour), body), body


SCENES = ("nodule in the air", "nodule", "lesion of another colour", "fracture", "vessel on a wall")


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("lit", [False, True])
def test_what_people_look_for_is_measured_and_nothing_else(name, lit):
    truth, body = scene(name)
    assert small_things(body, body, 8.0, lit=lit) == ()
    assert lost_things(small_things(truth, truth, 8.0, lit=lit), 0.99) == ()
    (lost,) = lost_things(small_things(body, truth, 8.0, lit=lit), 0.5)
    assert lost.kept < 0.35  # noise of a fifth of the contrast counts as light
    assert lost.is_thin == (name in {"fracture", "vessel on a wall"})


def test_shades_of_one_colour_are_no_contrast_in_a_lit_picture():
    """A crease that a level shades otherwise has not lost anything."""
    truth, body = scene("fracture")
    truth[..., 3] = np.ceil(truth[..., 3])
    crease = np.where(np.ptp(truth - body, axis=-1, keepdims=True) > 0.1, truth, body)
    crease[..., :3] = np.where(np.abs(truth - body).max(-1, keepdims=True) > 0.1, 0.3, 1.0) * np.array([0.5, 0.4, 0.3])
    crease *= truth[..., 3:] > 0
    flat = np.where(truth[..., 3:] > 0, np.array([0.5, 0.4, 0.3, 1.0]), 0.0)
    crease[..., 3] = flat[..., 3]
    assert len(small_things(flat, crease, 8.0)) > 0
    assert small_things(flat, crease, 8.0, lit=True) == ()


def test_contrast_that_is_gone_is_a_loss_and_contrast_that_grows_is_not():
    truth, body = scene("lesion of another colour")
    assert contrast_loss(truth, truth, 4.0) == pytest.approx(0.0, abs=1e-6)
    assert contrast_loss(body, truth, 4.0) == pytest.approx(0.1, abs=0.03)
    assert contrast_loss(body + 2.0 * (truth - body), truth, 4.0) < 0.03


@pytest.mark.parametrize("name", SCENES)
def test_contrast_of_a_thing_is_kept_where_the_body_behind_it_changes(name):
    truth, body = scene(name)
    thing = truth - body
    shade = 0.4 * np.linspace(0.0, 1.0, truth.shape[1])[:, None] * (body[..., 3:] > 0)
    for share in (1.0, 0.5, 0.0):
        assert kept_contrast(body + share * thing, truth, 8.0) == pytest.approx(share, abs=0.15)
        assert kept_contrast(body + share * thing - shade * body, truth, 8.0) == pytest.approx(share, abs=0.2)
    assert kept_contrast(body, body, 8.0) is None


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


@pytest.mark.parametrize("lowest", [0.002, 0.1])
@pytest.mark.parametrize("steps", [1, 2])
def test_an_error_of_a_step_or_two_has_the_flip_that_it_has_without_rounding(lowest, steps):
    truth = np.zeros((40, 40, 4))
    truth[..., :3] = np.linspace(lowest, lowest + 0.3, 40)[:, None, None] * np.array([1.0, 0.8, 0.6])
    truth[..., 3] = 1.0
    drawn = np.minimum(truth + steps / 255, 1.0)
    exact = seen_flip(drawn, truth)
    found = seen_numbers(in_8_bits(drawn), truth, (), is_of_target=True).flip
    assert found == pytest.approx(max(exact.black, exact.white), rel=0.1)
