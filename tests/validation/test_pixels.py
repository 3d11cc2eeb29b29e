"""How a view of a coarse level is judged."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from volprep.truth.camera import standard_views
from volprep.validation.pixels import judged_level
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
    level = Level(index=2, factors_zyx=(4, 4, 4), grid=GRID, texture_from_box_per_mm_xyz=(1.0, 1.0, 1.0), filter=name)
    subject: Any = SimpleNamespace(shape_hw=(SIDE, SIDE), cameras=standard_views(GRID), is_lit=False)
    return judged_level("anterior", blob(HALF), blob(0.0), Tolerance(), subject, level, boxes).shift_voxels


HALF = SIDE * 2.0 / standard_views(GRID)["anterior"].height_mm


def test_a_shift_is_measured_unless_the_filter_widens_things() -> None:
    assert shift("box") == pytest.approx(0.5, abs=0.05)
    assert shift("maximum") is None
    assert shift("minimum") is None


def test_a_level_that_lies_where_box_means_lie_is_not_shifted() -> None:
    assert shift("box", {"anterior": blob(0.0)}) == pytest.approx(0.5, abs=0.05)
    assert shift("box", {"anterior": blob(HALF)}) == pytest.approx(0.0, abs=0.01)
    assert shift("box", {"posterior": blob(0.0)}) is None
