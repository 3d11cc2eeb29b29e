"""Early ray termination leaves less than a step does, whatever the step: a finer step is never worse."""

from itertools import pairwise

import numpy as np
import pytest
from closed_forms import marschner_lobb
from scene_builds import view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.render.renderer import Renderer
from volprep.truth.metrics import over
from volprep.truth.oracle import oracle_picture
from volprep.truth.phantoms import distance, sampled
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid

SHAPE_HW = (32, 32)
GRID = Grid.of((20, 24, 22), (1.3, 1.0, 1.1))
STEP_MM = 0.5
RATIOS = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
VIEW = "anterior-left"
# Veils in front of what is opaque: rays end at every depth, and colours behind differ from those in front.
OPAQUE = function(
    (0.0, (0.9, 0.2, 0.1), 4.0),
    (80.0, (0.1, 0.8, 0.9), 1.2),
    (160.0, (1.0, 0.9, 0.3), 0.25),
    (255.0, (0.2, 0.3, 1.0), 0.0),
)


def codes_of(name):
    extent_mm_xyz = GRID.extent_mm_zyx[::-1]
    if name == "ball":
        values = sampled(distance(tuple(e / 2 for e in extent_mm_xyz)), GRID) / 14.0
    else:
        values = sampled(marschner_lobb(extent_mm_xyz, frequency=2.0), GRID)
    return np.rint(np.clip(values, 0.0, 1.0) * 255).astype(np.uint8)


def pictures(package, target):
    box_from_clip = view_of(GRID, VIEW)
    with Renderer(package, target=target) as renderer:
        return [renderer.render(box_from_clip, SHAPE_HW, ratio * STEP_MM).astype(np.float64) for ratio in RATIOS]


def errors_of(package, target, truth):
    return [float(np.sqrt(np.mean((picture - truth) ** 2))) for picture in pictures(package, target)]


def truth_of(codes):
    box_from_clip = view_of(GRID, VIEW)
    return oracle_picture(Volume(codes, GRID), OPAQUE, box_from_clip, SHAPE_HW, tolerance=1e-7).rgba


@pytest.mark.parametrize(("name", "profile"), [("ball", ES3), ("waves", ES3), ("waves", ES2)])
def test_a_finer_step_is_never_worse_with_early_termination(tmp_path, name, profile):
    codes = codes_of(name)
    package = tiny_package(tmp_path / "p", codes, OPAQUE, profile, grid=GRID, step_mm=STEP_MM, cutoff=0.998)
    truth = truth_of(codes)
    assert 0.05 < np.mean(truth[..., 3] > 0.998) < 0.95
    for coarser, finer in pairwise(errors_of(package, "rgba8", truth)):
        # What is left of it in the end is rounding to 8 bits, which no step changes: 1/255/sqrt(12) = 0.0011.
        assert finer <= coarser * 1.01


def test_with_early_termination_the_error_falls_as_without_it(tmp_path):
    codes = codes_of("waves")
    # A table of 256 entries is the function at all codes; half floats are what is left in the end.
    wishes = {"grid": GRID, "step_mm": STEP_MM}
    truth = truth_of(codes)
    ending = errors_of(tiny_package(tmp_path / "e", codes, OPAQUE, cutoff=0.998, **wishes), "rgba32f", truth)
    whole = errors_of(tiny_package(tmp_path / "w", codes, OPAQUE, **wishes), "rgba32f", truth)
    assert all(finer < coarser for coarser, finer in pairwise(ending))
    for one, other in zip(ending, whole, strict=True):
        assert one == pytest.approx(other, rel=0.1)
    assert ending[2] > 20 * ending[-1]


def test_what_is_behind_the_end_of_a_ray_does_not_show_as_a_hole(tmp_path):
    """0.99 rounds to 252 of 255: over white, what is black and opaque would be grey."""
    codes = np.full(GRID.shape_zyx, 255, np.uint8)
    black = function((0.0, (0.0, 0.0, 0.0), 0.0), (255.0, (0.0, 0.0, 0.0), 1.0))
    package = tiny_package(tmp_path / "p", codes, black, grid=GRID, step_mm=STEP_MM, cutoff=0.99)
    nominal = pictures(package, "rgba8")[RATIOS.index(1.0)]
    assert over(nominal, "white")[14:18, 14:18].max() == 0.0
