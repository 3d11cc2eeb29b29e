"""Labels in blocks: what an app finds empty while segments are hidden is what a student would find."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volprep.parts.skip.label_sets import label_set_texels
from volprep_formats.package.parts.segments.label_sets import (
    ANY_LABEL,
    room_for_sets,
    set_texels,
    sets_shape,
    shown_blocks_of,
)


def blocks_of(shape, block):
    return tuple(max(1, math.ceil((n - 1) / block)) for n in shape)


def expected(labels, block, style_of, shown, is_shown):
    """Block by block, the voxels of its corners included."""
    found = np.zeros(blocks_of(labels.shape, block), bool)
    for place in itertools.product(*map(range, found.shape)):
        own = labels[tuple(slice(k * block, k * block + block + 1) for k in place)]
        found[place] = any(is_shown[label] and shown[(style_of[label], *place)] for label in np.unique(own))
    return found


@given(st.tuples(*[st.integers(1, 9)] * 3), st.integers(1, 4), st.integers(1, 300), st.integers(0, 2**32 - 1))
def test_a_block_is_shown_if_a_shown_label_in_it_has_a_style_that_shows_its_values(shape, block, count, seed):
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, count, shape).astype(np.uint16)
    labels[: shape[0] // 2] = 0
    style_of = rng.integers(0, 2, count)
    shown = rng.random((2, *blocks_of(shape, block))) < 0.7
    texels = label_set_texels(labels, block, style_of, shown)
    assert texels.shape == (1, *sets_shape(shown[0].size), 2)
    for share in (0.0, 0.1, 0.5, 1.0):
        is_shown = rng.random(count) < share
        found = shown_blocks_of(texels, shown[0].size, is_shown).reshape(shown[0].shape)
        assert np.array_equal(found, expected(labels, block, style_of, shown, is_shown))


def test_sets_that_do_not_fit_are_of_blocks_that_are_never_empty():
    rng = np.random.default_rng(1)
    shape = (8, 16, 32)
    labels = rng.integers(0, 30000, shape).astype(np.uint16)
    labels[:, :, :8] = 7
    shown = np.ones((1, *blocks_of(shape, 1)), bool)
    texels = label_set_texels(labels, 1, np.zeros(30000, np.intp), shown)
    of_block = texels.view("<u2").ravel()[: shown[0].size].reshape(shown[0].shape)
    lost = of_block == ANY_LABEL
    assert 0.2 < lost.mean() < 0.7
    assert not lost[:, :, :7].any()
    found = shown_blocks_of(texels, shown[0].size, np.zeros(30000, bool)).reshape(lost.shape)
    assert np.array_equal(found, lost)


@pytest.mark.parametrize(
    ("of_block", "sets", "shown"),
    [
        ([0, 1, 2], [[0], [1, 2]], [False, True, False]),
        # A set that is not there, and a label that is not there.
        ([3, 1, 9], [[0], [1, 500]], [True, True, True]),
    ],
)
def test_what_is_not_told_counts_as_shown(of_block, sets, shown):
    numbers = [np.array(each, np.uint16) for each in (of_block, *sets)]
    texels = set_texels(numbers[0], numbers[1:], (1, 16))
    assert shown_blocks_of(texels, 3, np.array([True, False, False])).tolist() == shown
    assert room_for_sets(3) == 2048 - 3
