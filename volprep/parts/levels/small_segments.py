"""More rays at small segments, with weights that leave the mean of a picture as it is.

A segment of a few voxels takes a hundredth of a picture, and chance sends one ray in a hundred through it: on a body
with seven lit segments, five of them of 1 to 16 voxels, a step of 0.7 voxel promised RMSE 0.0025 and drew 0.0059. So
the views along the axes have more rays through the boxes of small segments. The weight of a ray is the density of rays
by chance divided by the density that rays have at its place.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.parts.levels.rays import RaySegments
from volprep.scan.segments.record import VoxelBox
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

_EACH = 8
"""More rays through the box of a segment, in each view."""
_MOST_SEGMENTS = 32
"""The smallest count."""
_ENOUGH = 4.0
"""Rays by chance that are enough for a segment."""
_AROUND_VOXELS = 0.5
"""A voxel has some weight up to its neighbour's centre."""


@dataclass(frozen=True)
class SegmentBoxes:
    """Boxes around segments, in the box space of level 0."""

    low_mm_xyz: Float64Array
    """[box, xyz]: lower corners."""
    high_mm_xyz: Float64Array
    """[box, xyz]: upper corners."""

    @classmethod
    def of(cls, boxes: Sequence[VoxelBox], grid: Grid, start_zyx: tuple[int, int, int]) -> "SegmentBoxes":
        """Return boxes of voxels of a scan. `grid` is the grid of its part that begins at `start_zyx`."""
        sides = np.array([[box.start_zyx, box.stop_zyx] for box in boxes], np.float64).reshape(-1, 2, 3)
        sides += np.array([-_AROUND_VOXELS, _AROUND_VOXELS])[:, None] - np.array(start_zyx)
        sides_mm = np.clip(sides * grid.spacing_mm_zyx, 0.0, grid.extent_mm_zyx)[..., ::-1]
        held = (sides_mm[:, 1] > sides_mm[:, 0]).all(axis=1)
        return cls(*sides_mm[held].swapaxes(0, 1))

    def aimed_at(
        self, lines: RaySegments, axis: int, area_mm2: float, generator: np.random.Generator
    ) -> tuple[RaySegments, Float64Array]:
        """Return the rays of a picture along an axis with more through small boxes, and the weight of each ray.

        `lines` are as long as each other; they are spread evenly over an area of the picture.
        """
        across = [dimension for dimension in range(3) if dimension != axis]
        low, high = self.low_mm_xyz[:, across], self.high_mm_xyz[:, across]
        sizes = (high - low).prod(axis=1)
        per_mm2 = len(lines.lengths_mm) / area_mm2
        small = np.argsort(sizes, kind="stable")[:_MOST_SEGMENTS]
        small = small[sizes[small] * per_mm2 < _ENOUGH]
        low, high, sizes = low[small], high[small], sizes[small]
        places = low[:, None] + generator.random((len(small), _EACH, 2)) * (high - low)[:, None]
        more = lines.taken(np.zeros(len(small) * _EACH, np.intp))
        more.starts_mm_xyz[:, across] = places.reshape(-1, 2)
        joined = RaySegments.joined([lines, more])
        at = joined.starts_mm_xyz[:, None, across]
        inside = ((at >= low) & (at < high)).all(axis=2)
        return joined, per_mm2 / (per_mm2 + inside @ (_EACH / sizes))
