"""The true picture of maximum intensity difference accumulation, against many samples and where it is simpler."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.truth.oracle import oracle_picture
from volprep.truth.refined import refined_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid

UNIT = (1.0, 1.0, 1.0)
VEIL = function((0.0, (0.1, 0.2, 0.4), 0.05), (90.0, (1.0, 0.5, 0.0), 0.3), (255.0, (1.0, 1.0, 1.0), 1.5))


def accumulated(values, function, step_mm):
    """What Bruckner and Groeller print, sample by sample."""
    points = function.points
    low, high = function.intensity_range
    at = [p.value for p in points]
    result, greatest = np.zeros(4), 0.0
    for value in values:
        intensity = np.clip((value - low) / (high - low), 0, 1)
        kept = 1.0 - max(intensity - greatest, 0.0)
        greatest = max(greatest, intensity)
        alpha = 1.0 - np.exp(-np.interp(value, at, [p.extinction_per_mm for p in points]) * step_mm)
        colour = np.array([np.interp(value, at, [p.colour[k] for p in points]) for k in range(3)])
        gain = (1.0 - kept * result[3]) * alpha
        result = kept * result + gain * np.append(colour, 1.0)
    return result


def mida_picture(volume, grid, slope, intercept, shown, *view):
    return refined_picture(Volume(volume, grid, slope, intercept), shown, *view, intensities=shown.intensity_range)


def against_samples(oracle, seed, shown):
    """The true picture of one ray through random values, and how far the printed sum is from it with finer samples."""
    rng = np.random.default_rng(seed)
    volume = rng.integers(0, 256, (5, 6, 7)).astype(np.uint8)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    origin = np.array([3.5, 3.0, 2.5]) + rng.uniform(-1, 1, 3) - 8 * direction
    start, end = oracle.inside_box(origin, direction, 20.0, np.array([7.0, 6.0, 5.0]))
    grid = Grid.of(volume.shape, UNIT)
    picture = mida_picture(volume, grid, 1.0, 0.0, shown, oracle.ray(origin, direction, 20.0), (1, 1))
    errors = []
    for count in (4_000, 8_000):
        places = start + (np.arange(count) + 0.5) / count * (end - start)
        values = oracle.trilinear(volume.astype(float), origin + np.multiply.outer(places, direction), UNIT)
        errors.append(np.abs(accumulated(values, shown, (end - start) / count) - picture.rgba[0, 0]).max())
    return picture, errors


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("intensities", [None, (40.0, 160.0)])
@pytest.mark.parametrize("seed", range(4))
def test_it_is_what_ever_finer_samples_tend_to(oracle, seed, intensities) -> None:
    picture, errors = against_samples(oracle, seed, VEIL.model_copy(update={"intensities": intensities}))
    assert picture.bound[0, 0] <= 1e-6
    # The printed sum has order 1.
    assert errors[1] < 1e-3
    assert errors[1] < 0.6 * errors[0] + 1e-6


@pytest.mark.parametrize("seed", range(2))
def test_a_rise_counts_where_no_control_point_lies_in_its_cell(oracle, seed) -> None:
    ramp = function((-5.0, (0.1, 0.2, 0.4), 0.05), (300.0, (1.0, 0.5, 0.0), 0.8))
    picture, errors = against_samples(oracle, seed, ramp.model_copy(update={"intensities": (0.0, 255.0)}))
    assert picture.rgba[0, 0, 3] > 0.5
    assert errors[1] < 1e-4


def test_where_nothing_rises_it_is_emission_and_absorption(oracle) -> None:
    volume = np.arange(20, 0, -1, dtype=np.uint8)[None, None, :].repeat(3, axis=0).repeat(3, axis=1)
    grid = Grid.of(volume.shape, UNIT)
    falling = function((0.0, (0.2, 0.5, 1.0), 0.0), (20.0, (1.0, 0.5, 0.0), 0.2))
    camera = oracle.ray((-1, 1.5, 1.5), (1, 0.01, 0), 30)
    one = mida_picture(volume, grid, 1.0, 0.0, falling, camera, (1, 1))
    other = oracle_picture(Volume(volume, grid), falling, camera, (1, 1))
    assert other.rgba[0, 0, 3] > 0.5
    assert np.abs(one.rgba - other.rgba).max() < 2e-6


def test_behind_a_dense_wall_what_is_brighter_is_seen(oracle) -> None:
    volume = np.full((3, 3, 12), 100, np.uint8)
    volume[:, :, 8:] = 255
    grid = Grid.of(volume.shape, UNIT)
    dense = function((0.0, (0.0, 0.0, 1.0), 50.0), (100.0, (0.0, 0.0, 1.0), 50.0), (255.0, (1.0, 0.0, 0.0), 50.0))
    camera = oracle.ray((-1, 1.5, 1.5), (1, 0, 0), 30)
    picture = mida_picture(volume, grid, 1.0, 0.0, dense, camera, (1, 1))
    hidden = oracle_picture(Volume(volume, grid), dense, camera, (1, 1))
    assert picture.rgba[0, 0, 0] > 0.15
    assert hidden.rgba[0, 0, 0] < 1e-9
    assert abs(picture.rgba[0, 0, 3] - 1.0) < 1e-6


def test_it_never_leaves_0_to_1_and_no_colour_is_brighter_than_its_opacity() -> None:
    rng = np.random.default_rng(8)
    volume = rng.integers(0, 256, (9, 12, 11)).astype(np.uint8)
    stiff = function((0.0, (0.1, 0.2, 0.4), 1e9), (90.0, (1.0, 0.5, 0.0), 0.0), (255.0, (1.0, 1.0, 1.0), 1e-3))
    grid = Grid.of(volume.shape, UNIT)
    camera = np.diag([7.0, 7.0, 9.0, 1.0])
    camera[:3, 3] = (5.5, 6.0, 4.5)
    camera[0, 2] = 2.0
    picture = mida_picture(volume, grid, 1.0, 0.0, stiff, camera, (12, 12))
    assert picture.rgba.min() >= 0.0
    assert picture.rgba.max() <= 1.0 + 1e-6
    assert (picture.rgba[..., :3] <= picture.rgba[..., 3:] + 1e-6).all()
