"""Levels of projections are made with the filter whose projections come nearest to those of level 0."""

import numpy as np
import pytest

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.level_input import LevelInput
from volprep.parts.levels.projected import ProjectedChooser
from volprep.parts.levels.rendered_rays import RaySight
from volprep.scan.slabs import RawVolume
from volprep.transfer.lookup import lookup_table
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

FACTORS = (2, 2, 2)
WINDOW = (0.0, 255.0)
SHAPE_ZYX = (24, 30, 28)
MIDDLE = {"maximum": 140.0, "minimum": 115.0}


def steep(compositing: str, name="steep", middle: float | None = None) -> TransferFunction:
    """Show what is above the middle, or below it in a minimum."""
    middle = middle or MIDDLE[compositing]
    low, high = (0.0, 2.0) if compositing == "maximum" else (2.0, 0.0)
    points = [
        TransferPoint(value=middle + aside, colour=(1.0, 1.0, 1.0), extinction_per_mm=extinction)
        for aside, extinction in ((-20.0, low), (20.0, high))
    ]
    return TransferFunction(name=name, points=tuple(points))


def noise() -> np.ndarray:
    """Noise in a cube: its greatest values are about where the steep function of a maximum begins."""
    voxels = np.zeros(SHAPE_ZYX, np.uint8)
    voxels[6:18, 6:18, 6:18] = np.random.default_rng(3).integers(0, 150, (12, 12, 12))
    return voxels


def vessels() -> np.ndarray:
    """Lines of one voxel, along every axis."""
    voxels = np.full(SHAPE_ZYX, 20, np.uint8)
    voxels[3, 7, :] = voxels[9, :, 12] = voxels[:, 20, 5] = voxels[15, 21, :] = 230
    return voxels


def chosen(tmp_path, voxels, compositing, functions=(), filters=()):
    """Choose level 1 of voxels, or of their opposites in a minimum."""
    seen = voxels if compositing == "maximum" else 255 - voxels
    path = tmp_path / "level0.raw"
    seen.tofile(path)
    functions = functions or (steep(compositing),)
    tables = {each.name: lookup_table(each, WINDOW, 256) for each in functions}
    scan = LevelInput(RawVolume(path, seen.shape, seen.dtype), Grid.of(seen.shape, (1.0, 1.0, 1.0)), tables)
    sight = RaySight(functions, WINDOW, "linear", COMPOSITINGS[compositing], lit=False)
    filters = filters or COMPOSITINGS[compositing].level_filters
    return ProjectedChooser(scan, sight, [FACTORS]).choose(1, FACTORS, filters, tmp_path.joinpath, lambda _: None)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("compositing", sorted(MIDDLE))
def test_a_sharp_vessel_is_kept_by_extrema_and_noise_by_means(tmp_path, compositing) -> None:
    both = ("box", compositing)
    assert chosen(tmp_path, vessels(), compositing, filters=both)[0].filter == compositing
    assert chosen(tmp_path, noise(), compositing, filters=both)[0].filter == "box"


def test_between_means_and_maxima_vessels_have_about_their_light(tmp_path) -> None:
    """Means lose them, and maxima make them thicker than they are."""
    choice, _ = chosen(tmp_path, vessels(), "maximum")
    tried = {trial.filter: trial for trial in choice.trials}
    assert choice.filter in {"appearance", "raised"}
    assert tried[choice.filter].seen_rmse < 0.8 * min(tried["box"].seen_rmse, tried["maximum"].seen_rmse)
    assert 0.6 < tried[choice.filter].kept_light < 1.4


def test_every_trial_is_recorded_and_only_the_chosen_level_is_kept(tmp_path) -> None:
    choice, codes = chosen(tmp_path, vessels(), "maximum", filters=("box", "maximum"))
    box, maximum = choice.trials
    assert (box.filter, maximum.filter) == ("box", "maximum")
    assert maximum.seen_rmse < 0.9 * box.seen_rmse
    assert box.kept_light < 0.5 < maximum.kept_light
    assert choice.tried[0].rmse == maximum.rmse
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1-maximum.raw", "level0.raw"]
    whole = vessels().reshape(12, 2, 15, 2, 14, 2).max(axis=(1, 3, 5))
    assert np.array_equal(codes.read_slab(0, 12), whole)


def test_no_transfer_function_may_pay_for_another(tmp_path) -> None:
    """Vessels beside noise: one function is above the noise and wants maxima, the other is better off with means."""
    both = np.maximum(vessels(), noise() // 2)
    above, within = steep("maximum", "above"), steep("maximum", "within", middle=70.0)
    two = ("box", "maximum")
    assert chosen(tmp_path, both, "maximum", (above,), two)[0].filter == "maximum"
    assert chosen(tmp_path, both, "maximum", (within,), two)[0].filter == "box"
    assert chosen(tmp_path, both, "maximum", (above, within), two)[0].filter == "box"


def test_a_filter_that_the_scene_names_is_measured_along_the_same_rays(tmp_path) -> None:
    every = {trial.filter: trial.seen_rmse for trial in chosen(tmp_path, noise(), "maximum")[0].trials}
    (named,) = chosen(tmp_path, noise(), "maximum", filters=("maximum",))[0].trials
    assert (named.filter, named.seen_rmse) == ("maximum", every["maximum"])


def test_a_volume_that_shows_nothing_has_means(tmp_path) -> None:
    choice, _ = chosen(tmp_path, np.zeros(SHAPE_ZYX, np.uint8), "maximum")
    assert choice.filter == "box"
    assert all(trial.seen_rmse == 0 for trial in choice.trials)
