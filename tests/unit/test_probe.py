"""The pictures of the sample of rays, against closed forms."""

import numpy as np
import pytest

from volprep.compositing.emission_absorption import EMISSION_ABSORPTION
from volprep.plan.probe import Quantizer
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint


def table(*points) -> Table:
    made = tuple(TransferPoint(value=v, colour=(1.0, 0.5, 0.25), extinction_per_mm=e) for v, e in points)
    return Table.exact(TransferFunction(name="t", points=made))


@pytest.mark.parametrize("slices", [1, 2, 63, 64, 65, 66, 130])
def test_a_homogeneous_ray_has_the_opacity_of_its_whole_length(slices) -> None:
    rays = EMISSION_ABSORPTION.rays(np.full((slices, 3), 7.0), 2.5, table((0.0, 0.02)), "linear")
    opacity = 1 - np.exp(-0.02 * 2.5 * slices)
    assert rays == pytest.approx(np.tile([opacity, opacity / 2, opacity / 4, opacity], (3, 1)), rel=1e-12)


def test_a_ramp_is_integrated_between_the_voxels() -> None:
    # Extinction equal to the value, 0 to 40 over 40 voxels: the midpoint rule is exact for a linear extinction.
    values = np.arange(41.0)[:, None]
    opacity = EMISSION_ABSORPTION.rays(values, 0.1, table((0.0, 0.0), (100.0, 1.0)), "linear")[0, 3]
    # Half a voxel of value 0 before, half a voxel of value 40 after.
    depth = 0.01 * 0.1 * (40**2 / 2 + 0.5 * 40)
    assert opacity == pytest.approx(1 - np.exp(-depth), rel=1e-12)


def test_codes_of_8_bits_are_off_by_half_a_step_at_most() -> None:
    quantizer = Quantizer(8, (-10.0, 41.0))
    values = np.linspace(-10.0, 41.0, 1001)
    error = np.abs(quantizer.decoded(quantizer.texels(values)) - values)
    assert error.max() <= 0.1 + 1e-12
    assert error.max() > 0.099


def test_codes_clamp_at_the_ends_of_the_window() -> None:
    quantizer = Quantizer(16, (0.0, 2.0))
    assert quantizer.decoded(quantizer.texels(np.array([-5.0, 0.0, 2.0, 9.0]))).tolist() == [0.0, 0.0, 2.0, 2.0]


def test_half_floats_keep_eleven_bits_of_a_16_bit_code() -> None:
    quantizer = Quantizer(16, (0.0, 1.0), half_floats=True)
    values = np.linspace(0.5, 1.0, 5001)
    error = np.abs(quantizer.decoded(quantizer.texels(values)) - values).max()
    assert 2**-12 * 0.9 < error <= 2**-12 + 2**-17


def test_other_texels_keep_all_of_a_16_bit_code() -> None:
    quantizer = Quantizer(16, (0.0, 1.0))
    values = np.linspace(0.5, 1.0, 5001)
    error = np.abs(quantizer.decoded(quantizer.texels(values)) - values).max()
    assert 0.5 / 65535 * 0.9 < error <= 0.5 / 65535 * 1.001


def test_a_lookup_table_interpolates_between_its_entries() -> None:
    exact = table((0.0, 0.0), (1.0, 4.0), (1.0, 0.0))
    resampled = exact.resampled((0.0, 2.0), 5)
    assert resampled.values.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    # At the jump the mean of both sides, as the stage writes it.
    assert resampled.extinction_per_mm.tolist() == [0.0, 2.0, 2.0, 0.0, 0.0]
