"""Pictures as small as a coarse level is meant for, and whether they are within the tolerance."""

import math

import numpy as np
from numpy.typing import NDArray

from volprep.plan.probe import difference
from volprep.validation.records import OtherView
from volprep.validation.subject import Subject
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Tolerance

Picture = NDArray[np.float32]


def pixels_of(subject: Subject, level: Level) -> int:
    """Return the size of pictures in which a voxel of the level is a pixel, or less than one.

    Half of that of the report at most, so that each pixel is the mean of four rays at least.
    """
    # Orthographic standard views have the height of the diagonal; in perspective it is a fifth more.
    voxels = math.hypot(*level.grid.extent_mm_zyx) / min(level.grid.spacing_mm_zyx)
    return max(1, min(subject.shape_hw[0] // 2, round(voxels)))


def judged(view: str, drawn: Picture, truth: Picture, tolerance: Tolerance) -> OtherView:
    """Compare one view with the truth, both as large as the level is meant for."""
    found = difference(drawn.astype(np.float64), truth.astype(np.float64))
    passed = found.rmse <= tolerance.rmse and found.maximum <= tolerance.maximum
    return OtherView(view=view, passed=passed, rmse=found.rmse, maximum=found.maximum)
