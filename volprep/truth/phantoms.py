"""Fields with known answers: sampled on a grid they become test volumes.

A field takes positions in box space [..., 3] (x, y, z in millimetres) and gives physical values [...]. Trilinear
interpolation reproduces a constant exactly; of a distance it makes an error that falls with the square of the spacing.
"""

from collections.abc import Callable

import numpy as np

from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid, Vector

Field = Callable[[Float64Array], Float64Array]


def constant(value: float) -> Field:
    """Return the same value everywhere."""
    return lambda box_mm: np.full(box_mm.shape[:-1], value)


def distance(centre_mm_xyz: Vector) -> Field:
    """Return the distance from a point: with steps in the transfer function, spherical shells."""
    centre = np.array(centre_mm_xyz)
    return lambda box_mm: np.linalg.norm(box_mm - centre, axis=-1)


def sampled(field: Field, grid: Grid) -> Float32Array:
    """Take the field's values at the centres of the grid's voxels, [z, y, x]."""
    axes_zyx = [(np.arange(n) + 0.5) * h for n, h in zip(grid.shape_zyx, grid.spacing_mm_zyx, strict=True)]
    z, y, x = np.meshgrid(*axes_zyx, indexing="ij")
    return field(np.stack([x, y, z], axis=-1)).astype(np.float32)
