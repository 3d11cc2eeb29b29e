"""Planes that cut a volume for which light was computed: their record, and their place in box space."""

from collections.abc import Sequence

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid, Vector
from volprep_formats.record import Record

MOST_PLANES = 12
"""Planes that readers cut with: OpenGL ES 2 promises 16 vectors of uniforms to fragment shaders."""


class ClipPlane(Record):
    """A plane. The volume on its inner side stays."""

    normal: Vector
    """Direction of the inner side, of any length but zero."""
    constant_mm: float
    """A point p is inside where normal · p + `constant_mm` is above 0, in millimetres times the length of `normal`."""


def planes_in_box(planes: Sequence[ClipPlane], grid: Grid) -> tuple[ClipPlane, ...]:
    """Return planes of the patient's space (LPS) in the box space of a grid, with normals of length 1."""
    world_from_box = np.array(grid.world_from_box)
    found: list[ClipPlane] = []
    for plane in planes:
        row = np.array([*plane.normal, plane.constant_mm]) @ world_from_box
        x, y, z, constant = (row / np.linalg.norm(row[:3])).tolist()
        found.append(ClipPlane(normal=(x, y, z), constant_mm=constant))
    return tuple(found)


def plane_numbers(planes: Sequence[ClipPlane]) -> Float64Array:
    """Return planes as an array [n, 4]: a, b, c and d, inside where a·x + b·y + c·z + d is above 0."""
    numbers: Float64Array = np.array([[*plane.normal, plane.constant_mm] for plane in planes], np.float64)
    return numbers.reshape(-1, 4)
