"""Times of pictures: a spread, and the driver's own clock."""

import numpy as np
import pytest
from scene_builds import view_of
from tiny_packages import ES3, function, tiny_package

from volprep.render.gpu_clock import EXTENSION, gpu_clock
from volprep.render.renderer import Renderer
from volprep.render.timing import Spread, gpu_times


class Interrupted:
    def __init__(self) -> None:
        self.asked = 0

    def measure_ms(self, draw):
        self.asked += 1
        return None if self.asked % 2 else 5.0


def test_a_spread_holds_quartiles() -> None:
    assert Spread.of([5.0, 1.0, 2.0, 4.0, 3.0]) == Spread(3.0, 2.0, 4.0, 5)
    assert Spread.of([7.0]) == Spread(7.0, 7.0, 7.0, 1)


def test_interrupted_pictures_do_not_count() -> None:
    clock = Interrupted()
    assert gpu_times(lambda: None, clock, 4) == Spread(5.0, 5.0, 5.0, 2)
    assert clock.asked == 4


def test_the_clock_of_the_driver_runs_longer_for_more_samples(tmp_path) -> None:
    grey = function((0.0, (1.0, 1.0, 1.0), 0.0), (255.0, (1.0, 1.0, 1.0), 0.01))
    package = tiny_package(tmp_path / "p", np.full((32, 32, 32), 99, np.uint8), grey, ES3)
    box_from_clip = view_of(package.manifest.grid, "left")
    with Renderer(package) as renderer:
        if gpu_clock(renderer.driver) is None:
            pytest.skip(f"the driver has no {EXTENSION}")
        few, many = (renderer.gpu_times(box_from_clip, (96, 96), step_mm, 4) for step_mm in (8.0, 0.05))
    assert few is not None
    assert many is not None
    assert many.median > 3 * few.median > 0
