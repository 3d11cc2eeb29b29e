"""Bytes of a field of light."""

import numpy as np
import pytest

from volprep.parts.light.codes import coded, coded_alike, left_out
from volprep.parts.light.solve import LightField

CURVE = np.array([[0.0, 1.0], [0.0, 1.0]])


def field_of(ends: np.ndarray) -> LightField:
    first, second = ends[..., 0], ends[..., 1] - ends[..., 0]
    texels = np.stack([first, second], axis=-1)[..., None].astype(np.float32)
    return LightField(texels, CURVE, (1.0, 1.0, 1.0), 1, 1.0, 0.0)


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.9), (-2.0, 3.0), (-0.9, -0.1), (0.0, 0.0)])
def test_ends_of_a_field_come_back_within_half_a_code(low, high) -> None:
    ends = np.random.default_rng(28).uniform(low, high, (5, 7, 3, 2))
    field = field_of(ends)
    codes = coded(field)
    found = codes.decoded(field).texels[..., 0]
    # The rarest ends, one in ten thousand, may be cut off: with so few, they lie within a code of the outermost.
    assert np.abs(np.stack([found[..., 0], found.sum(-1)], -1) - ends).max() < 0.6 * codes.largest / 255 + 1e-6
    assert codes.subtracted == pytest.approx(max(-ends.min(), 0.0), abs=0.02)


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.3), (-2.0, 3.0), (0.1, 200.0)])
def test_a_light_of_1_is_a_code_where_functions_are_edited(low, high) -> None:
    field = field_of(np.random.default_rng(28).uniform(low, high, (5, 7, 3, 2)))
    codes = coded_alike([field], holds_one=True)[0]
    one = (1.0 + codes.subtracted) / codes.largest * 255.0
    assert one == pytest.approx(round(one), abs=1e-9)
    assert 1 <= one <= 255
    found = codes.decoded(field).texels[..., 0]
    assert np.abs(found.sum(-1) - field.texels[..., 0].sum(-1)).max() < 0.6 * codes.largest / 255


def test_light_that_is_nowhere_below_0_is_not_moved() -> None:
    assert coded(field_of(np.full((2, 2, 2, 2), 0.5))).subtracted == 0.0


def in_colour(colours: np.ndarray) -> LightField:
    """A field whose light varies between colours, and by 0.01 beside them."""
    random = np.random.default_rng(28)
    parts = random.uniform(0.2, 1.0, (5, 7, 3, 2, len(colours)))
    ends = parts @ colours + 0.01 * random.normal(size=(5, 7, 3, 2, 3))
    texels = np.stack([ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]], axis=-2).astype(np.float32)
    beyond = (ends - ends.mean(axis=-1, keepdims=True)).reshape(-1, 3)
    return LightField(texels, CURVE, (1.0, 1.0, 1.0), 1, 1.0, 0.0, beyond.T @ beyond / len(beyond))


@pytest.mark.parametrize("colours", [[[1.0, 0.3, 0.2], [0.0, 0.7, 0.8]], [[0.8, 0.8, 0.8], [0.4, 0.4, 0.4]]])
def test_light_between_two_colours_and_white_comes_back_from_one_texel(colours) -> None:
    field = in_colour(np.array(colours))
    codes = coded(field)
    assert codes.slices.shape == (5, 7, 3, 4)
    assert max(codes.first_colour) == 1.0
    assert min(codes.first_colour) >= 0.0
    found = codes.decoded(field).texels
    assert np.sqrt(np.mean((found - field.texels) ** 2)) < 0.015


@pytest.mark.parametrize(("second", "least"), [((0.1, 0.9, 0.9), 0.0), ((0.1, 0.1, 0.9), 0.1)])
def test_what_two_colours_leave_out_is_what_does_not_come_back(second, least) -> None:
    field = in_colour(np.array([[0.9, 0.1, 0.1], second]))
    found = coded(field).decoded(field).texels
    off = np.sqrt(np.mean((found.cumsum(axis=-2) - field.texels.cumsum(axis=-2)) ** 2))
    assert left_out(field.hues) == pytest.approx(off, rel=0.05, abs=0.002)
    assert least <= left_out(field.hues) < least + 0.02


def test_codes_that_are_all_the_same_are_grey() -> None:
    field = in_colour(np.array([[1.0, 0.3, 0.2], [0.0, 0.7, 0.8]]))
    codes = coded(field)
    grey = codes._replace(texels=np.full_like(codes.texels, 200)).decoded(field).texels[..., 0, :]
    np.testing.assert_allclose(grey, codes.largest * 200 / 255 - codes.subtracted, rtol=1e-5)


def test_the_ends_of_four_numbers_are_halves_of_the_slices() -> None:
    ends = np.random.default_rng(28).uniform(0.0, 1.0, (5, 7, 3, 2, 4)).astype(np.float32)
    texels = np.stack([ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]], axis=-2)
    codes = coded(LightField(texels, CURVE, (1.0, 1.0, 1.0), 1, 1.0, 0.0))
    first, second = np.split(codes.slices, 2)
    np.testing.assert_allclose(first / 255.0 * codes.largest, ends[..., 0, :], atol=0.003)
    np.testing.assert_allclose(second / 255.0 * codes.largest, ends[..., 1, :], atol=0.003)
