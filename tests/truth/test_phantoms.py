import closed_forms
import numpy as np
import pytest
from scipy.integrate import quad

from volprep.truth import phantoms
from volprep_formats.grid import Grid

GRID = Grid.of((3, 4, 5), (2.0, 1.0, 0.5))


def test_sampling_takes_values_at_voxel_centres():
    volume = phantoms.sampled(closed_forms.ramp((1.0, 10.0, 100.0), 0.25), GRID)
    assert volume.shape == (3, 4, 5)
    assert volume.dtype == np.float32
    assert volume[0, 0, 0] == 0.25 + 0.25 + 5.0 + 100.0
    assert volume[2, 1, 4] == 0.25 + 2.25 + 15.0 + 500.0


def test_a_constant_and_a_distance_are_what_they_say():
    assert (phantoms.sampled(phantoms.constant(3.5), GRID) == 3.5).all()
    volume = phantoms.sampled(phantoms.distance((0.25, 0.5, 1.0)), GRID)
    assert volume[0, 0, 0] == 0.0
    assert volume[1, 3, 4] == pytest.approx(np.sqrt(2.0**2 + 3.0**2 + 2.0**2))


def test_the_marschner_lobb_signal_fills_its_range():
    field = closed_forms.marschner_lobb((10.0, 20.0, 40.0))
    at = lambda x, y, z: float(field(np.array([5 + 5 * x, 10 + 10 * y, 20 + 20 * z])))  # noqa: E731
    assert at(0, 0, -1) == pytest.approx(1.0)  # cos(2π·6·cos 0) = 1 on the axis
    assert at(0, 0, 1) == pytest.approx(0.2)
    # cos(π r / 2) = 7 / 8 puts the ring's phase at 10.5 π, and 6.5 / 6 cannot be: 11 / 12 gives its first minimum.
    assert at(2 / np.pi * np.arccos(11 / 12), 0, 1) == pytest.approx(0.0, abs=1e-12)
    volume = phantoms.sampled(field, Grid.of((40, 41, 42), (1.0, 20 / 41, 10 / 42)))
    assert volume.min() >= 0.0
    assert volume.max() <= 1.0


@pytest.mark.parametrize(
    "extinctions", [(0.0, 0.0), (0.3, 0.3), (0.0, 2.0), (2.0, 0.0), (0.9, 0.3), (40.0, 90.0), (90.0, 40.0)]
)
def test_the_light_of_a_linear_layer_is_its_integral(extinctions):
    length = 3.0
    near, far = (0.9, 0.2, 0.0), (0.1, 0.4, 1.0)
    first, last = extinctions
    extinction = lambda t: first + (last - first) * t / length  # noqa: E731
    through = lambda t: np.exp(-first * t - (last - first) * t * t / 2 / length)  # noqa: E731
    truth = [
        quad(lambda t: (n + (f - n) * t / length) * extinction(t) * through(t), 0, length, epsabs=1e-14, limit=200)[0]  # noqa: B023
        for n, f in [*zip(near, far, strict=True), (1.0, 1.0)]
    ]
    np.testing.assert_allclose(closed_forms.linear_light((near, far), extinctions, length), truth, atol=1e-13)


def test_layers_compose_front_to_back():
    light = closed_forms.layers_light([(1, 0, 0), (0, 1, 0)], [np.log(2), np.log(4)], [1.0, 1.0])
    np.testing.assert_allclose(light, [0.5, 0.5 * 0.75, 0.0, 1 - 0.5 * 0.25])
