"""Gradients from sums of differences of codes: divided by the kernel's weight and the spacing, along known axes.

Kernels: mobile volume rendering thesis, 3.1. A gradient is a covector: from index space it goes to the patient's by the
inverse transpose of index-to-world, which for orthonormal axes is the direction matrix over the spacing.
"""

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.normals.record import GradientKernel, NormalSpace

DIVISORS: dict[GradientKernel, int] = {"forward": 1, "central": 2, "thesis": 44, "sobel": 32, "isotropic": 72}
"""Each kernel's sum of differences of a ramp with a slope of 1 a voxel."""
_LARGEST_RATIO = 1e12
"""Beyond this ratio of spacings squares of float32 would vanish; an axis so long has no slope to speak of."""

Matrix = tuple[float, float, float, float, float, float, float, float, float]


def direction_matrix(grid: Grid, space: NormalSpace) -> Matrix:
    """Matrix, row by row, from sums of differences (x, y, z) to vectors whose direction is that of the gradient.

    Its scale is that of the finest axis: sums times the smallest spacing over each axis's own.
    """
    return _rows(_axes(grid, space) * _relative(grid))


def gradient_matrix(grid: Grid, space: NormalSpace, kernel: GradientKernel, physical_per_code: float = 1.0) -> Matrix:
    """Matrix, row by row, from sums of differences (x, y, z) of codes to gradients in physical units per millimetre."""
    return _rows(_axes(grid, space) * _relative(grid) * length_scale(grid, kernel, physical_per_code))


def length_scale(grid: Grid, kernel: GradientKernel, physical_per_code: float = 1.0) -> float:
    """Factor that scales a vector of `direction_matrix` to physical units per millimetre."""
    return abs(physical_per_code) / (DIVISORS[kernel] * min(grid.spacing_mm_zyx))


def gradients(
    codes: NDArray[np.generic], grid: Grid, kernel: GradientKernel, physical_per_code: float = 1.0
) -> Float32Array:
    """Return the gradient at each voxel as [z, y, x, (x, y, z)], along the volume's axes, in physical units per mm.

    `codes` are uint8, uint16 or float32, the whole volume of `grid`.
    """
    vectors = np.empty((*codes.shape, 3), np.float32)
    matrix = gradient_matrix(grid, "box", kernel, physical_per_code)
    _native.gradient(codes, kernel, (False, False), matrix, vectors)
    return vectors


def _relative(grid: Grid) -> Float64Array:
    spacing = np.array(grid.spacing_mm_zyx[::-1])
    relative: Float64Array = np.maximum(spacing.min() / spacing, 1 / _LARGEST_RATIO)
    return relative


def _axes(grid: Grid, space: NormalSpace) -> Float64Array:
    return np.eye(3) if space == "box" else np.array(grid.direction)


def _rows(matrix: Float64Array) -> Matrix:
    a, b, c, d, e, f, g, h, i = matrix.ravel().tolist()
    return a, b, c, d, e, f, g, h, i
