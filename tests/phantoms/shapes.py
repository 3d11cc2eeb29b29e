"""Volumes of simple shapes with soft borders, in voxels: 1 inside, 0 outside, linear over one voxel at the border."""

from collections.abc import Sequence

import numpy as np

from volprep_formats.arrays import Float64Array

Point = Sequence[float]
"""Place in voxels, xyz; voxel centres are whole numbers."""


class Canvas:
    """The voxel centres of a volume, on which shapes are drawn."""

    def __init__(self, shape_zyx: tuple[int, int, int]) -> None:
        """Take the number of voxels along each axis."""
        self._places_xyz = np.moveaxis(np.indices(shape_zyx, dtype=float)[::-1], 0, -1)

    def ball(self, centre: Point, radius: float) -> Float64Array:
        """Return a ball."""
        return self.tube(centre, centre, radius)

    def tube(self, start: Point, end: Point, radius: float) -> Float64Array:
        """Return a straight tube with round ends."""
        first, axis = np.array(start, float), np.subtract(end, start).astype(float)
        from_start = self._places_xyz - first
        share = np.clip(from_start @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
        return self._inside(radius - np.linalg.norm(from_start - share[..., None] * axis, axis=-1))

    def block(self, low: Point, high: Point) -> Float64Array:
        """Return a block between two corners."""
        sides = np.minimum(self._places_xyz - np.array(low), np.array(high) - self._places_xyz)
        return self._inside(sides.min(axis=-1))

    def gap(self, place: Point, normal: Point) -> Float64Array:
        """Return a plane that is one voxel thick."""
        unit = np.array(normal, float) / np.linalg.norm(normal)
        return self._inside(0.5 - np.abs((self._places_xyz - np.array(place)) @ unit))

    @staticmethod
    def _inside(depth: Float64Array) -> Float64Array:
        """Return the share of matter at a depth below a surface."""
        share: Float64Array = np.clip(depth + 0.5, 0.0, 1.0)
        return share
