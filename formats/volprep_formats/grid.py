"""The grid of a volume: the position of each voxel's centre in the patient's space."""

from collections.abc import Sequence
from typing import Annotated, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from volprep_formats.arrays import Float64Array
from volprep_formats.record import Record

LONGEST_AXIS = 2**31 - 1
"""Most voxels along an axis."""
Length = Annotated[float, Field(gt=0.0)]
Count = Annotated[int, Field(ge=1, le=LONGEST_AXIS)]
Index = Annotated[int, Field(ge=0, le=LONGEST_AXIS)]
Signed = Annotated[int, Field(ge=-LONGEST_AXIS, le=LONGEST_AXIS)]
Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]
Affine = tuple[Row, Row, Row]
"""The upper three rows of a 4×4 matrix whose last row is 0, 0, 0, 1."""

_THIN = 1 / 3
_FEW_SLICES = 12
_ORTHONORMAL_TOLERANCE = 1e-6


class Grid(Record):
    """Positions of the voxels of one level, in the patient's space."""

    shape_zyx: tuple[Count, Count, Count]
    """Number of voxels along each axis; x is the fastest axis in memory."""
    spacing_mm_zyx: tuple[Length, Length, Length]
    """Distance between neighbouring voxel centres along each axis, in millimetres."""
    origin_mm_xyz: Vector
    """World position (LPS) of the centre of voxel [0, 0, 0], in millimetres."""
    direction: tuple[Vector, Vector, Vector]
    """Rows of a 3×3 matrix whose columns are the unit world vectors along the index axes x, y and z."""
    extent_mm_zyx: tuple[Length, Length, Length]
    """True size of the volume. A level whose odd sizes were rounded up has voxels that reach beyond it."""

    @model_validator(mode="after")
    def _direction_is_orthonormal(self) -> Self:
        matrix = np.array(self.direction)
        if not np.allclose(matrix.T @ matrix, np.eye(3), rtol=0.0, atol=_ORTHONORMAL_TOLERANCE):
            msg = "direction must have orthonormal columns"
            raise ValueError(msg)
        return self

    @classmethod
    def of(
        cls,
        shape_zyx: tuple[int, int, int],
        spacing_mm_zyx: tuple[float, float, float],
        origin_mm_xyz: ArrayLike = (0.0, 0.0, 0.0),
        direction: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ) -> Self:
        """Make the grid of a finest level, whose extent is its shape times its spacing."""
        origin = np.asarray(origin_mm_xyz, dtype=np.float64)
        matrix = np.asarray(direction, dtype=np.float64)
        return cls(
            shape_zyx=shape_zyx,
            spacing_mm_zyx=spacing_mm_zyx,
            origin_mm_xyz=tuple(origin.tolist()),
            direction=tuple(tuple(row) for row in matrix.tolist()),
            extent_mm_zyx=tuple(n * h for n, h in zip(shape_zyx, spacing_mm_zyx, strict=True)),
        )

    def coarser(self, factors_zyx: tuple[int, int, int]) -> Self:
        """Grid of the level in which `factors_zyx` voxels of this one become one.

        Odd sizes round up; the extent stays; the origin moves by (f - 1) / 2 voxels along each axis.
        """
        shift_xyz = np.array([(f - 1) / 2 * h for f, h in zip(factors_zyx, self.spacing_mm_zyx, strict=True)])[::-1]
        origin = np.array(self.origin_mm_xyz) + np.array(self.direction) @ shift_xyz
        return type(self)(
            shape_zyx=tuple(-(-n // f) for n, f in zip(self.shape_zyx, factors_zyx, strict=True)),
            spacing_mm_zyx=tuple(h * f for h, f in zip(self.spacing_mm_zyx, factors_zyx, strict=True)),
            origin_mm_xyz=tuple(origin.tolist()),
            direction=self.direction,
            extent_mm_zyx=self.extent_mm_zyx,
        )

    def part(self, start_zyx: tuple[int, int, int], stop_zyx: tuple[int, int, int]) -> Self:
        """Grid of the voxels from `start_zyx` up to but without `stop_zyx`; they stay where they are."""
        origin = self.world_from_index @ [*start_zyx[::-1], 1.0]
        shape = tuple(stop - start for start, stop in zip(start_zyx, stop_zyx, strict=True))
        z, y, x = shape
        return self.of((z, y, x), self.spacing_mm_zyx, origin[:3], self.direction)

    @property
    def corner_mm_xyz(self) -> Float64Array:
        """World position of the corner of the volume: half a voxel before voxel [0, 0, 0]. Same for all levels."""
        half_xyz = np.array(self.spacing_mm_zyx[::-1]) / 2
        corner: Float64Array = np.array(self.origin_mm_xyz) - np.array(self.direction) @ half_xyz
        return corner

    @property
    def thin_axis(self) -> int | None:
        """Index axis (0 is x) along which the volume is less than a third of its second smallest extent, if any."""
        extent_xyz = np.array(self.extent_mm_zyx[::-1])
        thin, second, _ = np.argsort(extent_xyz, kind="stable").tolist()
        return int(thin) if extent_xyz[thin] < _THIN * extent_xyz[second] else None

    @property
    def is_thin_stack(self) -> bool:
        """Whether it is flat and has so few slices that a picture shows single voxels."""
        return self.thin_axis is not None and self.shape_zyx[2 - self.thin_axis] <= _FEW_SLICES

    @property
    def world_from_index(self) -> Float64Array:
        """4×4 matrix from (x, y, z, 1) in voxels to world millimetres."""
        matrix = np.eye(4)
        matrix[:3, :3] = np.array(self.direction) * np.array(self.spacing_mm_zyx[::-1])
        matrix[:3, 3] = self.origin_mm_xyz
        return matrix

    @property
    def world_from_box(self) -> Float64Array:
        """4×4 matrix from box space (millimetres along the index axes, the corner at 0) to world millimetres."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.direction
        matrix[:3, 3] = self.corner_mm_xyz
        return matrix


def row_of(numbers: Sequence[float]) -> Row:
    """Return four numbers as a row of a matrix."""
    x, y, z, at = numbers
    return x, y, z, at


def box_from_box(grid: Grid, placed: Affine | None, other: Grid) -> Affine:
    """Return the matrix from the box space of `other` to that of `grid`, whose space `placed` maps to that of `other`.

    In Python's numbers, which no library rounds in another way: the matrix is written into packages.
    """
    to_world = product_of(placed, _world_from_box(grid)) if placed is not None else _world_from_box(grid)
    return product_of(inverse_of(to_world), _world_from_box(other))


def _world_from_box(grid: Grid) -> Affine:
    halves = [h / 2 for h in reversed(grid.spacing_mm_zyx)]
    rows = grid.direction
    corner = [
        at - sum(part * half for part, half in zip(row, halves, strict=True))
        for at, row in zip(grid.origin_mm_xyz, rows, strict=True)
    ]
    first, second, third = (row_of((*row, at)) for row, at in zip(rows, corner, strict=True))
    return first, second, third


def product_of(one: Affine, other: Affine) -> Affine:
    """Return the map that applies `other`, then `one`."""

    def row(left: Row) -> Row:
        x, y, z, at = (sum(left[k] * other[k][column] for k in range(3)) for column in range(4))
        return row_of((x, y, z, at + left[3]))

    return row(one[0]), row(one[1]), row(one[2])


def inverse_of(matrix: Affine) -> Affine:
    """Return the inverse of a matrix whose columns are not in one plane."""
    (a, b, c, x), (d, e, f, y), (g, h, i, z) = matrix
    cofactors = ((e * i - f * h, c * h - b * i, b * f - c * e), (f * g - d * i, a * i - c * g, c * d - a * f),
                 (d * h - e * g, b * g - a * h, a * e - b * d))  # fmt: skip
    determinant = a * cofactors[0][0] + b * cofactors[1][0] + c * cofactors[2][0]
    rows = [tuple(value / determinant for value in row) for row in cofactors]
    first, second, third = (row_of((u, v, w, -(u * x + v * y + w * z))) for u, v, w in rows)
    return first, second, third


def blocks_along(voxels: int, cells: int) -> int:
    """Number of blocks of a given number of cells along an axis. Cells lie between voxels; one voxel makes a block."""
    return max(1, -(-(voxels - 1) // max(cells, 1)))
