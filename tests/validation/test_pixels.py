"""How a view of a coarse level is judged."""

from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from volprep.truth.camera import standard_views
from volprep.validation.comparison.pixels import _seen_at, errors_by_size, judged_level
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Tolerance

GRID = Grid.of((32, 32, 32), (4.0, 4.0, 4.0))
SIDE = 256


def blob(right: float) -> np.ndarray[Any, np.dtype[np.float32]]:
    """A soft white ball, so many pixels right of the middle."""
    along = np.arange(SIDE) - SIDE / 2
    grey = np.exp(-(along[:, None] ** 2 + (along - right) ** 2) / 40**2)
    return np.repeat(grey[..., None], 4, axis=-1).astype(np.float32)


def shift(name: str, boxes: dict[str, np.ndarray[Any, np.dtype[np.float32]]] | None = None) -> float | None:
    """The shift in voxels that is measured for a level, drawn half a voxel right of the truth."""
    level = Level(index=2, factors_zyx=(4, 4, 4), grid=GRID, filter=name)
    subject: Any = SimpleNamespace(shape_hw=(SIDE, SIDE), cameras=standard_views(GRID), is_lit=False)
    return judged_level("anterior", blob(HALF), blob(0.0), Tolerance(), subject, level, boxes).shift_voxels


VIEWS = ("left", "anterior", "right")
HALF = SIDE * 2.0 / standard_views(GRID)["anterior"].height_mm


def test_a_shift_is_measured_unless_the_filter_widens_things() -> None:
    assert shift("box") == pytest.approx(0.5, abs=0.05)
    assert shift("maximum") is None
    assert shift("minimum") is None


def test_a_level_that_lies_where_box_means_lie_is_not_shifted() -> None:
    assert shift("box", {"anterior": blob(0.0)}) == pytest.approx(0.5, abs=0.05)
    assert shift("box", {"anterior": blob(HALF)}) == pytest.approx(0.0, abs=0.01)
    assert shift("box", {"posterior": blob(0.0)}) is None


def sizes(drawn: np.ndarray[Any, np.dtype[np.float32]], allowed: float) -> list[tuple[int, bool]]:
    """Sizes of pictures in which a picture of a ball is measured, and whether it is within."""
    grid = Grid.of((64, 64, 64), (2.0, 2.0, 2.0))
    level = Level(index=1, factors_zyx=(2, 2, 2), grid=grid, filter="box")
    subject: Any = SimpleNamespace(shape_hw=(SIDE, SIDE), cameras=standard_views(grid), is_lit=False)
    tolerance = Tolerance(rmse=allowed, flip=1.0, kept_light=0.0)
    pictures, truths = {"anterior": drawn}, {"anterior": blob(0.0)}
    found = [judged_level("anterior", pictures["anterior"], truths["anterior"], tolerance, subject, level)]
    by_size = errors_by_size(pictures, truths, found, tolerance, subject, level)
    assert found[0].seen.rmse in {each.rmse for each in by_size}
    return [(each.pixels, each.passed) for each in by_size]


def test_a_level_is_measured_in_smaller_pictures_until_it_is_right_and_in_full_if_it_is() -> None:
    assert sizes(blob(2.0), allowed=0.5) == [(256, True), (111, True)]
    assert sizes(blob(2.0), allowed=1e-6) == [(111, False), (55, False), (32, False)]


def test_other_sizes_are_measured_in_the_worst_view_first_and_end_with_a_view_that_is_beyond() -> None:
    grid = Grid.of((64, 64, 64), (2.0, 2.0, 2.0))
    level = Level(index=1, factors_zyx=(2, 2, 2), grid=grid, filter="box")
    subject: Any = SimpleNamespace(shape_hw=(SIDE, SIDE), cameras=standard_views(grid), is_lit=False)
    pictures, truths = {"left": blob(0.0), "anterior": blob(2.0), "right": blob(0.0)}, dict.fromkeys(VIEWS, blob(0.0))
    found = [judged_level(name, pictures[name], truths[name], Tolerance(), subject, level) for name in pictures]
    (worst, *_) = sorted(found, key=lambda view: -view.seen.rmse)

    def measured(allowed: float) -> tuple[list[str], bool]:
        names: list[str] = []

        def seen_at(drawn: Any, truth: Any, *rest: Any) -> Any:
            names.append(next(name for name, picture in pictures.items() if picture is drawn))
            return _seen_at(drawn, truth, *rest)

        tolerance = Tolerance(rmse=allowed, flip=1.0, kept_light=0.0)
        with patch("volprep.validation.comparison.pixels._seen_at", seen_at):
            (largest, *_) = errors_by_size(pictures, truths, found, tolerance, subject, level)
        return names, largest.passed

    at_voxels = worst.seen.rmse
    assert measured(1.0) == (["anterior", "left", "right"], True)
    assert measured(1.001 * at_voxels) == (["anterior"], False)


def test_where_a_level_is_right_in_smaller_pictures_only_the_largest_of_them_is_sought() -> None:
    """Noise of single pixels, whose RMSE falls with the size: 0.0216 at 111 pixels, 0.0172 at 83, 0.0148 at 69."""
    noise = 0.1 * np.random.default_rng(1).standard_normal((SIDE, SIDE, 1)).astype(np.float32)
    noisy = np.clip(blob(0.0) + noise * (blob(0.0) > 0.1), 0.0, 1.0)
    assert sizes(noisy, allowed=0.017) == [(111, False), (83, False), (69, True), (55, True)]


def test_thin_things_of_a_level_are_those_of_pictures_in_which_its_voxels_are_pixels() -> None:
    """A line of two pixels is thin where a voxel has four of them; with one pixel for a voxel it is faint."""
    line = np.zeros((SIDE, SIDE, 4), np.float32)
    line[20:230, 128:130] = 0.08
    level = Level(index=2, factors_zyx=(4, 4, 4), grid=GRID, filter="box")
    subject: Any = SimpleNamespace(shape_hw=(SIDE, SIDE), cameras=standard_views(GRID), is_lit=False)
    found = judged_level("anterior", np.zeros_like(line), line, Tolerance(), subject, level)
    assert found.full is not None
    assert found.full.things == 1
    assert found.full.kept_light == pytest.approx(0.0, abs=0.01)
    assert found.seen.things == 0
