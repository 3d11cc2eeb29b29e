"""Palettes: exact where they have room, the best cut where they have not."""

import itertools

import numpy as np
import pytest

from volprep.transfer.palette import best_palette


def codes(count, seed=1):
    return np.random.default_rng(seed).integers(0, 256, (count, 4)).astype(np.uint8)


def error(rgba, palette, weights=None):
    return np.average(((palette.colours[palette.indices].astype(float) - rgba) ** 2).sum(axis=1), weights=weights)


def test_a_palette_with_room_for_every_colour_is_exact():
    rgba = codes(256)
    palette = best_palette(rgba, 256)
    np.testing.assert_array_equal(palette.colours[palette.indices], rgba)
    assert (palette.rmse, palette.maximum) == (0.0, 0.0)
    assert palette.indices.tolist() == list(range(256))


def test_codes_of_one_colour_share_an_entry_wherever_they_are():
    rgba = np.zeros((256, 4), np.uint8)
    rgba[100:110] = codes(10)
    palette = best_palette(rgba, 60)
    assert len(palette.colours) == 11
    assert palette.maximum == 0.0
    assert palette.indices[0] == palette.indices[255] == 0


@pytest.mark.parametrize("weights", [None, np.array([1.0, 5, 0, 2, 2, 9, 1, 3])])
def test_of_all_cuts_it_is_the_best(weights):
    rgba = codes(8)
    palette = best_palette(rgba, 3, weights)
    assert len(palette.colours) == 3
    share = np.ones(8) if weights is None else weights
    best = np.inf
    for cuts in itertools.combinations(range(1, 8), 2):
        total = 0.0
        for low, high in itertools.pairwise([0, *cuts, 8]):
            if share[low:high].sum() == 0:
                continue
            mean = np.average(rgba[low:high], axis=0, weights=share[low:high])
            total += (share[low:high, None] * (rgba[low:high] - mean) ** 2).sum()
        best = min(best, total / share.sum())
    # Colours are rounded to bytes: half a step in each of four channels at most.
    assert error(rgba, palette, weights) <= best + 4 * 0.25
    assert error(rgba, palette, weights) >= best - 1e-5


def test_more_entries_never_make_it_worse_and_none_beyond_the_limit():
    ramp = np.linspace(0, 255, 256)[:, None].repeat(4, 1).astype(np.uint8)
    errors = []
    for entries in (1, 2, 16, 60, 255):
        palette = best_palette(ramp, entries)
        assert len(palette.colours) <= entries
        errors.append(palette.rmse)
    assert errors == sorted(errors, reverse=True)
    # 60 runs of 4 or 5 codes: the root of their mean variance, 1.25 to 2, and half a step of rounding.
    assert errors[3] * 255 == pytest.approx(np.sqrt(1.55), abs=0.5)


def test_it_says_how_far_it_is_off():
    rgba = np.array([[0, 0, 0, 0], [10, 10, 10, 10], [255, 255, 255, 255]], np.uint8)
    palette = best_palette(rgba, 2)
    assert palette.colours.tolist() == [[5] * 4, [255] * 4]
    assert palette.maximum == pytest.approx(5 / 255)
    assert palette.rmse == pytest.approx(np.sqrt(2 / 3) * 5 / 255)


@pytest.mark.parametrize(("count", "entries"), [(0, 1), (257, 1), (3, 0), (3, 257)])
def test_what_no_byte_can_index_is_refused(count, entries):
    with pytest.raises(ValueError, match="expected 1 to 256"):
        best_palette(codes(count), entries)
