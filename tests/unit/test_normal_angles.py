"""How far off kernels and codes are: the angles that are known for them come out."""

import numpy as np
import pytest
from normal_fields import angles, coded, directions, positions, sphere, wave_gradients

from volprep.parts.gradient import DIVISORS, gradients
from volprep.truth.normal_codes import decoded
from volprep_formats.grid import Grid

# Of figures with so many digits the last may be half a unit off.
TWO_DIGITS, THREE_DIGITS = 0.005, 0.0005


@pytest.mark.parametrize(
    ("kernel", "largest", "mean", "rounding"),
    [
        # 1.7249: the printed 1.73 was rounded twice.
        ("central", 1.725, 1.117, THREE_DIGITS),
        ("thesis", 0.61, 0.40, TWO_DIGITS),
        ("sobel", 0.84, 0.55, TWO_DIGITS),
        ("isotropic", 0.033, 0.021, THREE_DIGITS),
    ],
)
def test_a_kernel_is_off_on_plane_waves_of_a_quarter_pi_by_what_is_known(kernel, largest, mean, rounding):
    waves = directions(20000) * np.pi / 4
    found = angles(wave_gradients(kernel, waves), waves)
    # 20 000 directions lie 1.4° apart: the largest error is flat where it is, and the mean an integral by midpoints.
    assert found.max() == pytest.approx(largest, abs=rounding)
    assert found.mean() == pytest.approx(mean, abs=rounding)


@pytest.mark.parametrize(
    ("code", "mean", "largest", "bound"),
    [
        # The bound is half the diagonal of a cell of codes over the length of the vector.
        ("biased8", 0.170, 0.383, np.degrees(np.sqrt(3) / 2 / 127)),
        ("snorm8", 0.170, 0.383, np.degrees(np.sqrt(3) / 2 / 127)),
        # On the octahedron vectors are as short as 1/√3, and its faces are seen under an angle: 3 times as much.
        ("oct8", 0.337, 0.949, np.degrees(3 * np.sqrt(2) / 2 / 127)),
        ("oct12", 0.021, 0.059, np.degrees(3 * np.sqrt(2) / 2 / 2047)),
    ],
)
def test_a_code_is_off_by_what_is_known(code, mean, largest, bound):
    vectors = directions(200_000)
    found = angles(coded(vectors, code), vectors)
    # float32 and the decoder leave no trace in three digits.
    assert found.mean() == pytest.approx(mean, abs=THREE_DIGITS)
    assert found.max() <= bound
    # The largest error is at single points, which directions 0.4° apart only come near to.
    assert 0.95 * largest <= found.max() <= largest + THREE_DIGITS + 0.02 * largest


def test_the_printed_decoding_has_no_zero_and_ours_has():
    """(c - 0.5) · 2 is what the mobile volume rendering thesis decodes: no byte gives 0."""
    octets = np.arange(256) / 255
    assert np.abs((octets - 0.5) * 2).min() == pytest.approx(1 / 255)
    assert not decoded(np.array([128, 128, 128], np.uint8), "biased8").any()


@pytest.mark.parametrize("code", ["biased8", "snorm8", "oct8", "oct12"])
def test_the_axes_are_exact_and_the_flag_is_no_direction(code):
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    np.testing.assert_allclose(coded(axes, code), axes, rtol=0, atol=1e-15)
    assert not coded(np.zeros((1, 3)), code).any()


def noisy_angles(kernel):
    at = positions(48)
    field = sphere(16.0, 3.0)
    rng = np.random.default_rng(0)
    volume = field.value(at) + rng.normal(0, 0.02, at.shape[:3])
    true = field.gradient(at)
    surface = np.linalg.norm(true, axis=-1) > 0.5 * np.linalg.norm(true, axis=-1).max()
    found = gradients(volume.astype(np.float32), Grid.of(volume.shape, (1.0, 1.0, 1.0)), kernel)
    return angles(found[surface].astype(np.float64), true[surface]).mean()


def test_on_a_noisy_shell_sobel_and_thesis_are_the_best_and_central_the_worst():
    found = {kernel: noisy_angles(kernel) for kernel in ("central", "isotropic", "thesis", "sobel")}
    assert found["central"] > 1.8 * found["isotropic"]
    assert found["isotropic"] > 1.15 * found["thesis"]
    # Noise adds up as the root of the sum of squares of the weights: thesis 100 / 22², sobel 36 / 8² per unit of slope.
    ratio = np.sqrt((8 * 0 + 4 * 1 + 4 * 9 + 36) / 22**2) / np.sqrt((4 * 1 + 4 * 4 + 16) / 16**2)
    assert found["thesis"] / found["sobel"] == pytest.approx(ratio, rel=0.03)


@pytest.mark.parametrize("kernel", DIVISORS)
@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (100.0, 1.0, 2.5)], ids=str)
def test_the_gradient_of_a_ramp_is_its_slope_per_millimetre_whatever_the_spacing(kernel, spacing):
    grid = Grid.of((4, 5, 6), spacing)
    z, y, x = (np.arange(n) * h for n, h in zip(grid.shape_zyx, spacing, strict=True))
    values = (z[:, None, None] * 0.5 + y[:, None] * 2.0 - x * 4.0).astype(np.float32)
    found = gradients(values, grid, kernel, physical_per_code=3.0)
    np.testing.assert_allclose(found, np.broadcast_to([-12.0, 6.0, 1.5], found.shape), rtol=1e-5)
