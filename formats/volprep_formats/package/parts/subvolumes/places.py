"""Positions of sub-volumes: the block around a grid point, its overall coordinates and the pieces' local ones.

Overall coordinates go from 0 to 1 through the block that a device draws, local ones from 0 to 1 through the texture of
a piece (Schultz and Bailey, 7.3.3). In the paper each piece fills half of the block, whatever its size, up to the outer
faces of its voxels; here a piece ends in the layers of voxels that it shares.
"""

from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Vector
from volprep_formats.package.parts.subvolumes.record import Cuts, Span, SubvolumeGrid, spans_of

NOWHERE = 1e9
"""A voxel beyond every volume: a side without pieces, which is never reached."""


@dataclass(frozen=True)
class Side:
    """The pieces of a block along an axis, and its ends; positions in voxels, with the centre of voxel k at k + ½."""

    split: float
    """Start of the upper piece."""
    low: tuple[int, int]
    """First voxel of the lower piece, and its number of voxels."""
    high: tuple[int, int]
    """The same of the upper piece."""
    begins: float
    """In the middle of the outer shared layer, or where the volume begins."""
    ends: float
    """In the middle of the outer shared layer, or where the volume ends."""


def side_of(at: int, cuts: Cuts, ghost: int = 0) -> Side:
    """Return the pieces around the point of number `at` along an axis, which hold `ghost` layers beyond their cuts."""
    spans = spans_of(cuts, ghost)
    below, above = at > 0, at < len(cuts) - 1
    low, high = at - 1 if below else at, at if above else at - 1
    first, last = max(at - 1, 0), min(at + 1, len(cuts) - 1)
    return Side(
        split=cuts[at] + 0.5 if below and above else (NOWHERE if below else -NOWHERE),
        low=_held(spans[low]),
        high=_held(spans[high]),
        begins=0.0 if first == 0 else cuts[first] + 0.5,
        ends=cuts[-1] + 1.0 if last == len(cuts) - 1 else cuts[last] + 0.5,
    )


def _held(span: Span) -> tuple[int, int]:
    """Return the first voxel of a piece, and its number of voxels."""
    first, last = span
    return first, last - first + 1


def place_of(grid: SubvolumeGrid, point: int) -> tuple[int, int, int]:
    """Return the number of a point along z, y and x."""
    z, y, x = np.unravel_index(point, [count + 1 for count in grid.counts_zyx])
    return int(z), int(y), int(x)


def sides_of(grid: SubvolumeGrid, point: int) -> tuple[Side, Side, Side]:
    """Return the pieces around a point along x, y and z."""
    ghost = grid.ghost or 0
    z, y, x = (side_of(at, cuts, ghost) for at, cuts in zip(place_of(grid, point), grid.cuts_zyx, strict=True))
    return x, y, z


def voxels_of(sides_xyz: tuple[Side, Side, Side]) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """Return the first voxel of a block along z, y and x, and the voxel after the last one."""
    x, y, z = ((side.low[0], sum(side.high)) for side in sides_xyz)
    return (z[0], y[0], x[0]), (z[1], y[1], x[1])


def ends_mm(
    sides_xyz: tuple[Side, Side, Side], spacing_mm_zyx: tuple[float, float, float]
) -> tuple[Float64Array, Float64Array]:
    """Return where a block begins and ends, x, y and z, from the corner of the box of its voxels."""
    spacing_mm_xyz = np.array(spacing_mm_zyx[::-1])
    starts = np.array([side.low[0] for side in sides_xyz])
    begins, ends = (np.array(value) for value in zip(*((side.begins, side.ends) for side in sides_xyz), strict=True))
    return (begins - starts) * spacing_mm_xyz, (ends - starts) * spacing_mm_xyz


def inner_point(grid: SubvolumeGrid, voxel_xyz: Vector) -> int:
    """Return the point nearest to a voxel for which a device can hold the two pieces around it along each axis."""
    place = []
    for at, cuts in zip(voxel_xyz[::-1], grid.cuts_zyx, strict=True):
        inner = range(1, len(cuts) - 1) if len(cuts) > 2 else range(1)
        place.append(min(inner, key=lambda number, at=at, cuts=cuts: abs(cuts[number] - at)))  # type: ignore[misc]
    return int(np.ravel_multi_index(place, [count + 1 for count in grid.counts_zyx]))


def voxel_of(grid: SubvolumeGrid, point: int, overall_xyz: Vector) -> Vector:
    """Return the voxel of level 0, the first at 0, at overall coordinates of the block around a point."""
    x, y, z = (
        side.begins + at * (side.ends - side.begins) - 0.5
        for side, at in zip(sides_of(grid, point), overall_xyz, strict=True)
    )
    return x, y, z


def overall_of(grid: SubvolumeGrid, point: int, voxel_xyz: Vector) -> Vector:
    """Return the overall coordinates of a voxel in the block around a point: outside 0 to 1 for one outside of it."""
    x, y, z = (
        (at + 0.5 - side.begins) / (side.ends - side.begins)
        for side, at in zip(sides_of(grid, point), voxel_xyz, strict=True)
    )
    return x, y, z


def local_of(grid: SubvolumeGrid, voxel_xyz: Vector) -> tuple[int, Vector]:
    """Return the number of the piece that holds a voxel, and the coordinates in its texture.

    One in a shared layer belongs to the upper piece, one outside the volume to the nearest piece.
    """
    place, coordinates = [], []
    for at, cuts, spans in zip(voxel_xyz, grid.cuts_zyx[::-1], grid.spans_zyx[::-1], strict=True):
        number = sum(at >= cut for cut in cuts[1:-1])
        first, count = _held(spans[number])
        place.append(number)
        coordinates.append((at - first + 0.5) / count)
    nz, ny, nx = grid.counts_zyx
    x, y, z = coordinates
    return int(np.ravel_multi_index(place[::-1], (nz, ny, nx))), (x, y, z)
