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


@pytest.mark.parametrize("name", ["box", "maximum", "minimum"])
def test_a_shift_is_measured_unless_the_filter_widens_things(name: str) -> None:
    level = Level(index=2, factors_zyx=(4, 4, 4), grid=GRID, texture_from_box_per_mm_xyz=(1.0, 1.0, 1.0), filter=name)
    subject: Any = SimpleNamespace(shape_hw=(SIDE, SIDE), cameras=standard_views(GRID))
    voxel_pixels = SIDE * 4.0 / subject.cameras["anterior"].height_mm
    found = judged_level("anterior", blob(voxel_pixels / 2), blob(0.0), Tolerance(), subject, level).shift_voxels
    if name == "box":
        assert found == pytest.approx(0.5, abs=0.05)
    else:
        assert found is None
