"""Gradients from sums of differences of codes, divided by the kernel's weight and the spacing, in box space.

Kernels: mobile volume rendering thesis, 3.1.
"""

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep_formats.arrays import Float32Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.normals.record import GradientKernel

DIVISORS: dict[GradientKernel, int] = {"forward": 1, "central": 2, "thesis": 44, "sobel": 32, "isotropic": 72}
"""Each kernel's sum of differences of a ramp with a slope of 1 a voxel."""
_LARGEST_RATIO = 1e12
"""Beyond this ratio of spacings squares of float32 would vanish; an axis so long has no slope to speak of."""

Scale = tuple[float, float, float]


def direction_scale(grid: Grid) -> Scale:
    """Factors of sums of differences along x, y and z that make vectors in the direction of the gradient.

    Each is the smallest spacing over that of its axis.
    """
    return _scale(grid, 1.0)


def gradients(
    codes: NDArray[np.generic], grid: Grid, kernel: GradientKernel, physical_per_code: float = 1.0
) -> Float32Array:
    """Return the gradient at each voxel as [z, y, x, (x, y, z)], along the volume's axes, in physical units per mm.

    `codes` are uint8, uint16 or float32, the whole volume of `grid`.
    """
    vectors = np.empty((*codes.shape, 3), np.float32)
    scale = _scale(grid, abs(physical_per_code) / (DIVISORS[kernel] * min(grid.spacing_mm_zyx)))
    _native.gradient(codes, kernel, (False, False), scale, vectors)
    return vectors


def _scale(grid: Grid, factor: float) -> Scale:
    spacing = np.array(grid.spacing_mm_zyx[::-1])
    x, y, z = (np.maximum(spacing.min() / spacing, 1 / _LARGEST_RATIO) * factor).tolist()
    return x, y, z
