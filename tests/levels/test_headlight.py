"""Light from the viewer along rays: samples that show nothing, or are hidden, need no gradient."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from volprep.parts.levels.headlight import Shown, headlight
from volprep.parts.levels.rays import random_lines, sample_level
from volprep.scan.in_memory import InMemory
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table

PER_VOXEL = 4
SPACING = (1.5, 1.0, 0.75)
WINDOW = (0.0, 255.0)


def table_of(*points: tuple[float, float]) -> Table:
    values, extinctions = np.array(points).T
    return Table(values, np.ones((len(values), 3)), extinctions)


@pytest.fixture(scope="module", params=[(False, False, False), (True, False, True)], ids=["level 0", "coarse"])
def lit(request):
    """Codes along rays through noise, and their light if all of them are lit."""
    codes = np.random.default_rng(3).integers(0, 256, (9, 14, 20), dtype=np.uint8)
    volume = InMemory.of(codes)
    lines = random_lines(Grid.of(codes.shape, SPACING), 40, seed=4)
    along = sample_level(volume, SPACING, lines, per_voxel=PER_VOXEL)

    def of(wanted):
        return headlight(volume, SPACING, lines, along, wanted, 1e-9, halved_zyx=request.param)

    return along, of, twin(codes, lines, along, request.param)


def twin(codes, lines, along, halved_zyx):
    """The same light, sample by sample; in the outer half voxels it is that at their inner ends, as in shaders."""
    counts = np.diff(along.offsets)
    number = np.arange(len(along.values)) - np.repeat(along.offsets[:-1], counts)
    aside_mm = (number + 0.5) * np.repeat(along.lengths_mm / counts, counts)
    starts, directions = (np.repeat(each, counts, axis=0) for each in (lines.starts_mm_xyz, lines.directions_xyz))
    places_zyx = ((starts + aside_mm[:, None] * directions) / SPACING[::-1] - 0.5)[:, ::-1]
    assert (places_zyx < 0).any()
    places_zyx = np.clip(places_zyx, 0, np.array(codes.shape) - 1)
    slopes = []
    for axis, apart in enumerate(np.where(halved_zyx, 0.5, 1.0)):
        upper, lower = (
            ndimage.map_coordinates(
                codes / 1.0, (places_zyx + side * apart * np.eye(3)[axis]).T, order=1, mode="nearest"
            )
            for side in (1, -1)
        )
        slopes.append((upper - lower) / (2 * apart * SPACING[axis]))
    return np.abs((np.array(slopes[::-1]).T * directions).sum(axis=1)) / np.linalg.norm(slopes, axis=0)


def test_samples_that_are_wanted_have_the_same_light_as_if_all_were(lit) -> None:
    along, light_of, expected = lit
    every = light_of(np.ones(len(along.values), bool))
    assert every.min() < 0.2
    np.testing.assert_allclose(every, expected, atol=1e-4)
    wanted = Shown([table_of((120.0, 0.0), (200.0, 0.3))], WINDOW).samples(along, PER_VOXEL)
    assert 0.2 < wanted.mean() < 0.9
    some = light_of(wanted)
    np.testing.assert_allclose(some[wanted], every[wanted], atol=1e-4)
    assert (some[~wanted] == 1.0).all()


def test_each_sample_that_shows_something_is_wanted_also_between_two_codes(lit) -> None:
    along, *_ = lit
    table = table_of((120.2, 0.0), (120.5, 0.01), (120.8, 0.0))
    wanted = Shown([table], WINDOW).samples(along, PER_VOXEL)
    shows = np.interp(along.values, table.values, table.extinction_per_mm) > 0.0
    assert shows.any()
    assert wanted[shows].all()
    assert wanted.mean() < 0.2


def test_samples_behind_opaque_ones_are_not_wanted_but_those_that_a_long_step_reaches(lit) -> None:
    along, *_ = lit
    opaque = table_of((0.0, 1000.0), (255.0, 1000.0))
    wanted = Shown([opaque], WINDOW).samples(along, PER_VOXEL)
    counts = [int(wanted[first:end].sum()) for first, end in zip(along.offsets, along.offsets[1:], strict=False)]
    lengths = np.diff(along.offsets)
    assert counts == [min(int(length), 2 * PER_VOXEL + 1) for length in lengths]
    # What one function hides another one may show.
    both = Shown([opaque, table_of((0.0, 1e-6), (255.0, 1e-6))], WINDOW).samples(along, PER_VOXEL)
    assert both.all()


def test_without_functions_all_samples_are_wanted(lit) -> None:
    along, *_ = lit
    assert Shown([], WINDOW).samples(along, PER_VOXEL).all()


def test_a_scan_of_one_value_has_one_code(lit) -> None:
    along, _, _ = lit
    constant = replace(along, values=np.zeros_like(along.values))
    assert Shown([table_of((7.0, 0.2), (9.0, 0.3))], (7.0, 7.0)).samples(constant, PER_VOXEL).any()
    assert not Shown([table_of((7.0, 0.0), (9.0, 0.0))], (7.0, 7.0)).samples(constant, PER_VOXEL).any()
