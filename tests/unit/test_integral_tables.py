"""Integral tables: exact differences, whatever stands beside what, against the exact light of segments."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.transfer.integral import ends_of_entries, in_unit, integrate
from volprep.transfer.segment_light import segment_light
from volprep.transfer.texel_forms import opaque_per_mm
from volprep_formats.package.function_table import Table
from volprep_formats.package.integral_table import LARGEST_SUM, IntegralTable

WHITE, RED = (1.0, 1.0, 1.0), (0.9, 0.1, 0.1)
WINDOW = (0.0, 60000.0)
OPAQUE_PER_MM = opaque_per_mm(0.5)


def integral(*points, entries=2048, window=WINDOW):
    table = Table.exact(function(*points))
    return table, integrate(table, ends_of_entries([table], window, entries), entries, OPAQUE_PER_MM)


def test_a_feature_of_a_window_of_100_is_resolved_among_60000_values():
    table, sums = integral((30000.0, RED, 0.0), (30050.0, RED, 20.0), (30100.0, RED, 0.0))
    front, back = np.array([29000.0, 30010.0, 30060.0, 59000.0]), np.array([31000.0, 30040.0, 30000.0, 40000.0])
    # So thin that attenuation inside it does not count.
    _, exact = segment_light(table, front, back, 1e-6)
    colour, extinction = sums.at(front, back)
    np.testing.assert_allclose(extinction, exact, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(colour[exact > 0], np.tile(RED, (3, 1)), atol=1e-5)


@pytest.mark.parametrize("apart", [1e-6, 1.0, 40.0, 3000.0])
def test_a_haze_beside_a_wall_keeps_its_extinction_and_colour_however_near_the_ends_are(apart):
    _, sums = integral((0.0, WHITE, 1e9), (20000.0, WHITE, 1e9), (20000.0, RED, 0.02), (60000.0, RED, 0.02))
    colour, extinction = sums.at(np.array([41234.5]), np.array([41234.5 + apart]))
    # 32 bits over 2048 entries: steps of a hundredth of it between neighbouring entries, of less over several.
    assert extinction[0] == pytest.approx(0.02, rel=0.02)
    np.testing.assert_allclose(colour[0], RED, atol=0.02)
    _, through = sums.at(np.array([19990.0]), np.array([20010.0]))
    assert through[0] > OPAQUE_PER_MM


def test_no_colour_is_brighter_than_white():
    rng = np.random.default_rng(7)
    values, extinctions = np.sort(rng.uniform(*WINDOW, 50)), 10.0 ** rng.uniform(-6, 9, 50)
    _, sums = integral(*((value, WHITE, extinction) for value, extinction in zip(values, extinctions, strict=True)))
    grown = np.diff(sums.sums, axis=0)
    assert (grown[:, :3] <= grown[:, 3:]).all()
    assert sums.sums[-1, 3] == LARGEST_SUM


def test_texels_hold_all_digits_of_the_sums():
    _, sums = integral((100.0, RED, 0.0), (200.0, WHITE, 3.0), (300.0, RED, 0.0))
    decoded = IntegralTable.of_texels(sums.texels, sums.ends, sums.mean_per_mm)
    np.testing.assert_array_equal(decoded.sums, sums.sums)


def test_tables_of_one_shader_share_a_unit():
    _, faint = integral((0.0, RED, 0.1), (60000.0, RED, 0.3))
    scaled = in_unit(faint, 2.0 * faint.mean_per_mm)
    front, back = np.array([500.0, 30000.0]), np.array([40000.0, 30001.0])
    for one, other in zip(scaled.at(front, back), faint.at(front, back), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-5)


def test_a_function_that_shows_nothing_has_sums_of_zero():
    _, sums = integral((0.0, RED, 0.0))
    assert not sums.sums.any()
    assert sums.mean_per_mm > 0
