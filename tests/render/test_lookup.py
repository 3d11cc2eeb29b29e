"""Lookup tables against the transfer function itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tiny_packages import function

from volprep.transfer.lookup import lookup_table, lookup_texels
from volprep.transfer.texel_forms import opaque_per_mm
from volprep_formats.package.function_table import Table

RAMP = function((-10.0, (0.0, 0.2, 1.0), 0.0), (30.0, (1.0, 0.4, 0.5), 2.0), (40.0, (0.0, 0.0, 0.0), 0.5))
fractions = st.floats(0.0, 1.0)


@st.composite
def functions(draw):
    count = draw(st.integers(1, 6))
    values = sorted(draw(st.lists(st.integers(-300, 300), min_size=count, max_size=count, unique=True)))
    return function(
        *(
            (float(value), (draw(fractions), draw(fractions), draw(fractions)), draw(st.floats(0.0, 100.0)))
            for value in values
        )
    )


@given(functions())
def test_without_jumps_it_is_linear_interpolation_clamped_outside(transfer_function):
    values = np.linspace(-310.0, 310.0, 977)
    colour, extinction = Table.exact(transfer_function).at(values)
    at = [point.value for point in transfer_function.points]
    want = np.interp(values, at, [point.extinction_per_mm for point in transfer_function.points])
    np.testing.assert_allclose(extinction, want, rtol=1e-12, atol=1e-12)
    for channel in range(3):
        want = np.interp(values, at, [point.colour[channel] for point in transfer_function.points])
        np.testing.assert_allclose(colour[:, channel], want, rtol=1e-12, atol=1e-12)


def test_a_jump_is_the_mean_at_its_value_and_sharp_beside_it():
    black, white = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    jump = function((0.0, black, 0.0), (5.0, black, 1.0), (5.0, white, 3.0), (10.0, white, 3.0))
    colour, extinction = Table.exact(jump).at(np.array([np.nextafter(5.0, 0), 5.0, np.nextafter(5.0, 10)]))
    np.testing.assert_allclose(extinction, [1.0, 2.0, 3.0], rtol=1e-12)
    np.testing.assert_allclose(colour[:, 0], [0.0, 0.5, 1.0], rtol=1e-12, atol=1e-12)


def test_a_jump_at_the_first_or_last_value_is_one_too():
    black = (0.0, 0.0, 0.0)
    jump = function((0.0, black, 0.0), (0.0, black, 4.0), (1.0, black, 4.0), (1.0, black, 2.0))
    _, extinction = Table.exact(jump).at(np.array([-1.0, 0.0, 0.5, 1.0, 2.0]))
    np.testing.assert_allclose(extinction, [0.0, 2.0, 4.0, 3.0, 2.0])


@given(functions(), st.sampled_from([2, 3, 256, 1000]))
def test_bytes_are_off_by_their_rounding_only(transfer_function, entries):
    window = (-300.0, 300.0)
    colour, extinction = Table.exact(transfer_function).at(np.linspace(*window, entries))
    table = lookup_texels(lookup_table(transfer_function, window, entries), "rgba8unorm")
    texels = table.texels[0, 0].astype(np.float64) / 255
    assert table.max_extinction_per_mm == (extinction.max() or 1.0)
    assert np.abs(texels[:, :3] - colour).max() <= 0.5 / 255 + 1e-12
    # A root r that is off by e gives an extinction that is off by (2 r e + e²) of the largest.
    error = np.abs(table.max_extinction_per_mm * texels[:, 3] ** 2 - extinction)
    allowed = table.max_extinction_per_mm * (2 * texels[:, 3] + 0.5 / 255) * (0.5 / 255)
    assert (error <= allowed + 1e-12).all()


@given(functions())
def test_half_floats_hold_colour_and_extinction_to_eleven_bits(transfer_function):
    window = (-300.0, 300.0)
    colour, extinction = Table.exact(transfer_function).at(np.linspace(*window, 256))
    table = lookup_texels(lookup_table(transfer_function, window, 256), "rgba16float")
    texels = table.texels[0, 0].astype(np.float64)
    assert table.max_extinction_per_mm is None
    assert np.abs(texels - np.column_stack([colour, extinction])).max() <= 2.0**-11 * max(1.0, extinction.max())


def test_faint_extinction_survives_in_bytes_beside_an_opaque_one():
    fog_and_bone = function((0.0, (1.0, 1.0, 1.0), 0.001), (1.0, (1.0, 1.0, 1.0), 20.0))
    table = lookup_texels(lookup_table(fog_and_bone, (0.0, 1.0), 256), "rgba8unorm")
    fog = 20.0 * (table.texels[0, 0, 0, 3] / 255) ** 2
    assert fog == pytest.approx(0.001, rel=0.4)


@pytest.mark.parametrize("form", ["rgba8unorm", "rgba16float"])
def test_a_wall_takes_nothing_from_the_fog_in_front_of_it(form):
    white = (1.0, 1.0, 1.0)
    fog_and_wall = function((0.0, white, 0.02), (0.5, white, 0.02), (0.5, white, 1e9), (1.0, white, 1e9))
    table = lookup_texels(lookup_table(fog_and_wall, (0.0, 1.0), 256), form, opaque_per_mm(0.5))
    extinction = table.texels[0, ..., 3].astype(float)
    if table.max_extinction_per_mm is not None:
        extinction = table.max_extinction_per_mm * (extinction / 255) ** 2
    assert extinction[0, 0] == pytest.approx(0.02, rel=0.15)
    assert -np.expm1(-0.125 * extinction[-1, -1]) == pytest.approx(1 - 2**-16, abs=2**-17)


@pytest.mark.parametrize("entries", [256, 257], ids=["between two entries", "at an entry"])
@pytest.mark.parametrize("falls", [False, True])
def test_the_ramp_from_a_haze_to_a_wall_has_the_colour_of_the_wall(entries, falls):
    haze, wall = ((1.0, 0.2, 0.1), 0.02), ((0.1, 0.2, 1.0), 1e9)
    sides = (wall, haze) if falls else (haze, wall)
    steep = function((0.0, *sides[0]), (0.5, *sides[0]), (0.5, *sides[1]), (1.0, *sides[1]))
    table = lookup_table(steep, (0.0, 1.0), entries)[:: -1 if falls else 1]
    opaque = table[:, 3] > 0.02
    first = int(np.argmax(opaque))
    assert first in {127, 128}
    np.testing.assert_array_equal(table[first - 1 :, :3], np.tile(wall[0], (entries - first + 1, 1)))
    np.testing.assert_array_equal(table[: first - 1, :3], np.tile(haze[0], (first - 1, 1)))


def test_a_function_that_shows_nothing_gives_a_table_of_zero_extinction():
    nothing = function((0.0, (0.5, 0.5, 0.5), 0.0))
    assert not lookup_texels(lookup_table(nothing, (0.0, 1.0), 4), "rgba8unorm").texels[..., 3].any()
    assert not lookup_texels(lookup_table(nothing, (0.0, 1.0), 4), "rgba16float").texels[..., 3].any()


def test_extinction_beyond_half_floats_is_clamped_to_the_largest():
    table = lookup_texels(lookup_table(function((0.0, (1.0, 1.0, 1.0), 1e9)), (0.0, 1.0), 2), "rgba16float")
    assert (table.texels[..., 3] == 65504).all()


def test_a_step_longer_than_the_volume_clamps_no_more_than_one_as_long_as_its_edge():
    assert opaque_per_mm(2.0, (1.0, 4.0, 3.0)) == opaque_per_mm(1.0)
    assert opaque_per_mm(0.5, (1.0, 4.0, 3.0)) == opaque_per_mm(0.5)


def test_the_first_and_last_entry_are_the_ends_of_the_window():
    table = lookup_texels(lookup_table(RAMP, (-10.0, 30.0), 5), "rgba16float")
    np.testing.assert_allclose(table.texels[0, 0, :, 3].astype(float), [0.0, 0.5, 1.0, 1.5, 2.0])
