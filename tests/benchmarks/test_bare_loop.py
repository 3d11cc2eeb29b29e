"""The limit of a ray caster reads what the package reads."""

import numpy as np
import pytest
from sample_counts import samples_per_pixel
from tiny_packages import function, tiny_package

from tests.benchmarks.bare_loop import bare, taking_all
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views

GLOW = function((0.0, (0.1, 0.2, 0.3), 0.0), (100.0, (0.1, 0.2, 0.3), 0.5), (200.0, (0.9, 0.2, 0.7), 0.9))


@pytest.fixture
def package(tmp_path):
    codes = np.full((8, 9, 10), 100, np.uint8)
    codes[:3] = 0
    return tiny_package(tmp_path, codes, GLOW, skip=("distance", 2), cutoff=0.9)


def camera(package, view):
    grid = package.manifest.levels[0].grid
    return standard_views(grid)[view].box_from_clip(grid, 1.0)


def test_the_loop_gives_the_mean_of_the_table_along_a_ray(package):
    (program,) = package.manifest.level_programs
    with Renderer(bare(package, program), target="rgba32f") as renderer:
        seen = renderer.render(camera(package, "anterior"), (33, 33))
    lit = seen[seen[..., 3] > 0.49]
    assert len(lit) > 50
    np.testing.assert_allclose(lit.max(axis=0), (0.1, 0.2, 0.3, 0.5), atol=2e-3)


def test_a_package_that_takes_all_samples_takes_those_that_it_skips_and_those_behind_its_early_end(package):
    (program,) = package.manifest.level_programs
    whole = taking_all(package, program)
    box_from_clip = camera(package, "superior")
    taken, looked = samples_per_pixel(package, program, 0, box_from_clip, (33, 33))
    every, none = samples_per_pixel(whole, whole.manifest.level_programs[0], 0, box_from_clip, (33, 33))
    assert looked.max() > 0 == none.max()
    assert taken.max() < every.max() == pytest.approx(8 / 0.5)
